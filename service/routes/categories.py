"""/v1/categories: inspect, name, forget, and the pictures behind one."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from service.deps import ActorDep, AgentDep, WorkDep
from service.exchange import MemoryRoute
from service.gallery import CategoryGallery
from service.routes.answers import by_id, category
from service.routes.png import PNG_RESPONSES, Side, png
from service.schemas.categories import (
    Category,
    CategoryList,
    CategoryMerge,
    CategoryPatch,
    CategorySimilarities,
    CategorySplit,
    Instance,
    InstanceList,
)
from service.schemas.problem import problems

router = APIRouter(prefix="/v1/categories", tags=["categories"], route_class=MemoryRoute)

View = Annotated[int, Path(ge=0, description="Which of the reference's views, from 0.")]


@router.get("")
def list_categories(agent: AgentDep) -> CategoryList:
    """All categories, oldest first."""
    return CategoryList(categories=[Category.of(category) for category in agent.memory.categories.all()])


@router.get("/{category_id}", responses=problems(404, 422))
def get_category(category_id: str, agent: AgentDep) -> Category:
    """One category."""
    return category(agent, category_id)


@router.patch("/{category_id}", responses=problems(404, 422, 503))
def name_category(category_id: str, patch: CategoryPatch, agent: AgentDep, actor: ActorDep) -> Category:
    """Says what people call it; null takes the name away."""
    return Category.of(agent.curation.rename(category_id, patch.name, actor=actor))


@router.delete("/{category_id}", status_code=204, responses=problems(404, 422, 503))
def delete_category(category_id: str, agent: AgentDep, actor: ActorDep) -> None:
    """Forgets it: its reference and every burst assigned to it."""
    agent.curation.delete(category_id, actor=actor)


@router.post("/{category_id}/merge", responses=problems(404, 409, 422, 503))
def merge_category(category_id: str, merge: CategoryMerge, agent: AgentDep, actor: ActorDep) -> Category:
    """The bursts of another category join this one, which keeps its reference, name and goals; the other one is gone."""
    return Category.of(agent.curation.merge(merge.source, category_id, actor=actor))


@router.post("/{category_id}/split", status_code=201, responses=problems(404, 409, 422, 503))
async def split_category(category_id: str, split: CategorySplit, agent: AgentDep, work: WorkDep, actor: ActorDep) -> Category:
    """Some bursts leave for a new category, whose reference is made of the views of the first of them that allows it."""
    return await work.run(lambda: Category.of(agent.curation.split(category_id, split.instance_ids, split.name, actor=actor)))


@router.get("/{category_id}/instances", responses=problems(404, 422))
def list_instances(category_id: str, agent: AgentDep) -> InstanceList:
    """The bursts assigned to it, oldest first, and where each came from."""
    agent.memory.categories.get(category_id)
    return InstanceList(instances=[Instance.of(each) for each in agent.memory.instances.of(category_id)])


@router.delete("/{category_id}/instances/{instance_id}", status_code=204, responses=problems(404, 409, 422, 503))
def delete_instance(category_id: str, instance_id: str, agent: AgentDep, actor: ActorDep) -> None:
    """Takes a burst out of it, such as one that was recognised wrongly."""
    agent.curation.forget_instance(category_id, instance_id, actor=actor)


@router.get("/{category_id}/similarity", responses=problems(404, 422, 503))
def category_similarity(category_id: str, agent: AgentDep) -> CategorySimilarities:
    """How like each other its bursts are, and how like it the other categories."""
    return CategorySimilarities.of(agent.curation.similarities(category_id), agent.names())


@router.get("/{category_id}/views/{view}/rgb.png", response_class=Response, responses=PNG_RESPONSES)
def category_rgb(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """A reference view."""
    return png(CategoryGallery(agent, category_id).rgb(view), side)


@router.get("/{category_id}/views/{view}/depth.png", response_class=Response, responses=PNG_RESPONSES)
def category_depth(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """Its depth for the eye: near is bright, far is dark; what was not measured is filled in at half brightness."""
    return png(CategoryGallery(agent, category_id).depth(view), side)


@router.get("/{category_id}/views/{view}/mask.png", response_class=Response, responses=PNG_RESPONSES)
def category_mask(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """What of the view is taken for the object: white on it, black elsewhere."""
    return png(CategoryGallery(agent, category_id).mask(view), side)


@router.get("/{category_id}/views/{view}/saliency.png", response_class=Response, responses=PNG_RESPONSES)
def category_saliency(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """How much each patch of its close crop stands out: bright is object, dark is background."""
    return png(CategoryGallery(agent, category_id).saliency(view), side)


@router.get("/{category_id}/views/{view}/foreground.png", response_class=Response, responses=PNG_RESPONSES)
def category_foreground(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """Its close crop with everything dimmed that is not taken for the object."""
    return png(CategoryGallery(agent, category_id).foreground(view), side)


@router.get("/{category_id}/views/{view}/pca.png", response_class=Response, responses=PNG_RESPONSES)
def category_pca(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """Its patches coloured by the reference's first three principal components, alike in all views."""
    return png(CategoryGallery(agent, category_id).pca(view), side)


@router.get("/{category_id}/views/{view}/overlay.png", response_class=Response, responses=PNG_RESPONSES)
def category_overlay(category_id: str, view: View, agent: AgentDep, side: Side = None) -> Response:
    """A reference view with the reference's oriented box over it; the object's x, y and z axes are red, green and blue."""
    return png(CategoryGallery(agent, category_id).overlay(view), side)


@router.get(
    "/{category_id}/cloud.ply",
    response_class=Response,
    responses={200: {"description": "A binary PLY file", "content": {"application/octet-stream": {}}}, **problems(404, 422, 503)},
)
def category_cloud(category_id: str, agent: AgentDep) -> Response:
    """The reference's points, metres in the world frame of its scan."""
    ply = CategoryGallery(agent, category_id).cloud_ply()
    return Response(
        ply, media_type="application/octet-stream", headers={"Content-Disposition": f'attachment; filename="{category_id}.ply"'}
    )


MADE = {"/v1/categories/{category_id}/merge": by_id(category), "/v1/categories/{category_id}/split": by_id(category)}
"""What a repeated request is answered with where its first answer was lost."""
