"""Which role each endpoint asks for: the table is all of it, and with a route that is missing from it the service does not start."""

from __future__ import annotations

from collections.abc import Mapping

from store.keys import ROLES, Role

VIEWER: Role = "viewer"
ROBOT: Role = "robot"
ADMIN: Role = "admin"
ACCESS: Mapping[str, Role | None] = {
    # Open to everybody: probes, which tell nothing of the memory.
    "healthz": None,
    "readyz": None,
    # Reading.
    "info": VIEWER,
    "metrics": VIEWER,
    "memory": VIEWER,
    "events": VIEWER,
    "list_changes": VIEWER,
    "list_observations": VIEWER,
    "get_observation": VIEWER,
    "observation_rgb": VIEWER,
    "observation_foreground": VIEWER,
    "observation_pca": VIEWER,
    "observation_overlay": VIEWER,
    "observation_correspondences": VIEWER,
    "list_scans": VIEWER,
    "get_scan": VIEWER,
    "list_categories": VIEWER,
    "get_category": VIEWER,
    "list_instances": VIEWER,
    "category_similarity": VIEWER,
    "category_rgb": VIEWER,
    "category_depth": VIEWER,
    "category_mask": VIEWER,
    "category_saliency": VIEWER,
    "category_foreground": VIEWER,
    "category_pca": VIEWER,
    "category_overlay": VIEWER,
    "category_cloud": VIEWER,
    "list_goals": VIEWER,
    "get_goal": VIEWER,
    # What a robot does: looking, scanning, following, and taking things where they belong.
    "observe": ROBOT,
    "track": ROBOT,
    "begin_scan": ROBOT,
    "exclude_viewpoints": ROBOT,
    "add_scan_views": ROBOT,
    "complete_scan": ROBOT,
    "delete_scan": ROBOT,
    "create_goal": ROBOT,
    "plan": ROBOT,
    # Changing what was learnt, and the memory as a whole.
    "correct_observation": ADMIN,
    "name_category": ADMIN,
    "delete_category": ADMIN,
    "merge_category": ADMIN,
    "split_category": ADMIN,
    "delete_instance": ADMIN,
    "delete_goal": ADMIN,
    "undo_change": ADMIN,
    "calibrate_memory": ADMIN,
    "backup_memory": ADMIN,
    "export_memory": ADMIN,
    "import_memory": ADMIN,
    # The console's pages.
    "console_now": VIEWER,
    "console_now_side": VIEWER,
    "console_observations": VIEWER,
    "console_observation_card": VIEWER,
    "console_observation_views": VIEWER,
    "console_observation_matches": VIEWER,
    "console_observation_scene": VIEWER,
    "console_observation_correct": ADMIN,
    "console_trying": VIEWER,
    "console_demo": VIEWER,
    "console_demo_start": ADMIN,
    "console_demo_stop": ADMIN,
    "console_observation": VIEWER,
    "console_categories": VIEWER,
    "console_category": VIEWER,
    "console_category_cover": VIEWER,
    "console_category_scene": VIEWER,
    "console_category_nearest": VIEWER,
    "console_memory": VIEWER,
    "console_memory_map": VIEWER,
    "console_calibrate": ADMIN,
    "console_backup": ADMIN,
    "console_export": ADMIN,
    "console_rename": ADMIN,
    "console_plan_merge": ADMIN,
    "console_merge": ADMIN,
    "console_split": ADMIN,
    "console_forget": ADMIN,
    "console_plan_deletion": ADMIN,
    "console_delete": ADMIN,
    "console_undo": ADMIN,
    "console_sign_in": None,
    "console_begin_session": None,
    "console_end_session": None,
}
"""By the route's name, which is its operation id, after `console_` for a page; None asks nobody for a key."""


def needed_role(name: str) -> Role | None:
    """What the route of this name takes. Raises LookupError for one that the table does not have."""
    if name not in ACCESS:
        raise LookupError(f"nothing says which role the route {name!r} takes: add it to ACCESS in service/access.py")
    return ACCESS[name]


def allows(role: Role, needed: Role) -> bool:
    """Whether `role` may do what takes `needed`."""
    return ROLES.index(role) >= ROLES.index(needed)
