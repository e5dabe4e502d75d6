"""An arm that is drawn, by the numbers of Denavit and Hartenberg in the order of Craig (1986).

from one joint axis to the next: Rot(x, alpha) Trans(x, a) Rot(z, theta + q) Trans(z, d)
"""

from collections.abc import Sequence

import numpy as np

import jointplay as jp


def rows_of(m: jp.Mechanism, joints: Sequence[str], output: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of every joint alpha, a, theta, d in units of the file; the pose of the first axis, and of the output.

    Parameters
    ----------
    m : Mechanism
        All bodies are drawn in the axes of the ground.
    joints : sequence of str
    output : ndarray
        Where the output is drawn.
    """
    at = np.array([m.value(f"joints.{name}.at") for name in joints], dtype=float)
    axes = np.array([m.value(f"joints.{name}.axis") for name in joints], dtype=float)
    frames, ends = [], [at[0]]
    for k in range(len(joints) - 1):
        normal, apart = np.cross(axes[k], axes[k + 1]), at[k + 1] - at[k]
        if np.linalg.norm(normal) > 1e-9:
            along = np.linalg.solve(np.column_stack([axes[k], -axes[k + 1], normal]), apart)
            foot, end = at[k] + along[0] * axes[k], at[k + 1] + along[1] * axes[k + 1]
        else:
            normal = apart - (apart @ axes[k]) * axes[k]
            foot, end = at[k], at[k] + normal
        frames.append(_pose(normal / np.linalg.norm(normal), axes[k], foot))
        ends.append(end)
    # No axis follows the last one.
    frames.append(_pose(_across(axes[-1], frames[-1][:3, 0]), axes[-1], ends[-1]))
    rows = np.zeros((len(joints), 4))
    for k in range(1, len(joints)):
        x, z = frames[k - 1][:3, 0], axes[k]
        rows[k] = [
            np.arctan2(np.cross(axes[k - 1], z) @ x, axes[k - 1] @ z),
            (ends[k] - frames[k - 1][:3, 3]) @ x,
            np.arctan2(np.cross(x, frames[k][:3, 0]) @ z, x @ frames[k][:3, 0]),
            (frames[k][:3, 3] - ends[k]) @ z,
        ]
    tool = np.eye(4)
    tool[:3, 3] = output
    return rows, frames[0], np.linalg.inv(frames[-1]) @ tool


def _across(axis: np.ndarray, near: np.ndarray) -> np.ndarray:
    across = near - (near @ axis) * axis
    return np.asarray(across / np.linalg.norm(across))


def _pose(x: np.ndarray, z: np.ndarray, at: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3] = np.column_stack([x, np.cross(z, x), z, at])
    return pose
