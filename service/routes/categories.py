"""/v1/categories: inspect, name, forget, and the pictures behind one."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from fastapi.responses import FileResponse

from service.deps import AgentDep
from service.gallery import CategoryGallery
from service.routes.png import PNG_RESPONSES, png
from service.schemas.categories import Category, CategoryList, CategoryPatch
from service.schemas.problem import problems

router = APIRouter(prefix="/v1/categories", tags=["categories"])

View = Annotated[int, Path(ge=0, description="Which of the reference's views, from 0.")]


@router.get("")
def list_categories(agent: AgentDep) -> CategoryList:
    """All categories, oldest first."""
    return CategoryList(categories=[Category.of(category) for category in agent.memory.categories.all()])


@router.get("/{category_id}", responses=problems(404, 422))
def get_category(category_id: str, agent: AgentDep) -> Category:
    """One category."""
    return Category.of(agent.memory.categories.get(category_id))


@router.patch("/{category_id}", responses=problems(404, 422, 503))
def name_category(category_id: str, patch: CategoryPatch, agent: AgentDep) -> Category:
    """Says what people call it; null takes the name away."""
    return Category.of(agent.memory.categories.rename(category_id, patch.name))


@router.delete("/{category_id}", status_code=204, responses=problems(404, 422, 503))
def delete_category(category_id: str, agent: AgentDep) -> None:
    """Forgets it: its reference and every burst assigned to it."""
    agent.memory.categories.delete(category_id)


@router.get("/{category_id}/views/{view}/rgb.png", response_class=Response, responses=PNG_RESPONSES)
def category_rgb(category_id: str, view: View, agent: AgentDep) -> FileResponse:
    """A reference view."""
    return FileResponse(agent.memory.categories.rgb_file(category_id, view), media_type="image/png")


@router.get("/{category_id}/views/{view}/depth.png", response_class=Response, responses=PNG_RESPONSES)
def category_depth(category_id: str, view: View, agent: AgentDep) -> Response:
    """Its depth for the eye: near is bright, far is dark, not measured is black."""
    return png(CategoryGallery(agent, category_id).depth(view))


@router.get("/{category_id}/views/{view}/foreground.png", response_class=Response, responses=PNG_RESPONSES)
def category_foreground(category_id: str, view: View, agent: AgentDep) -> Response:
    """Its close crop with everything dimmed that is not taken for the object."""
    return png(CategoryGallery(agent, category_id).foreground(view))


@router.get("/{category_id}/views/{view}/pca.png", response_class=Response, responses=PNG_RESPONSES)
def category_pca(category_id: str, view: View, agent: AgentDep) -> Response:
    """Its patches coloured by the reference's first three principal components, alike in all views."""
    return png(CategoryGallery(agent, category_id).pca(view))


@router.get("/{category_id}/views/{view}/overlay.png", response_class=Response, responses=PNG_RESPONSES)
def category_overlay(category_id: str, view: View, agent: AgentDep) -> Response:
    """A reference view with the reference's oriented box over it; the object's x, y and z axes are red, green and blue."""
    return png(CategoryGallery(agent, category_id).overlay(view))


@router.get(
    "/{category_id}/cloud.ply",
    response_class=Response,
    responses={200: {"description": "A binary PLY file", "content": {"application/octet-stream": {}}}, **problems(404, 422)},
)
def category_cloud(category_id: str, agent: AgentDep) -> Response:
    """The reference's points, metres in the world frame of its scan."""
    ply = CategoryGallery(agent, category_id).cloud_ply()
    return Response(
        ply, media_type="application/octet-stream", headers={"Content-Disposition": f'attachment; filename="{category_id}.ply"'}
    )
