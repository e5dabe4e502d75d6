//! Parts of specifications for tests.

#![allow(dead_code)] // tests outside the crate use a part of it

use serde_json::{Value, json};

/// A pin between two points, as the specification has it.
pub fn pin(first: usize, second: usize) -> Value {
    json!({"kind": "revolute", "first": first, "second": second, "axis_first": [1, 0, 0], "axis_second": [1, 0, 0]})
}

/// A point of a body, or of the ground.
pub fn point(body: i64, x: f64, y: f64) -> Value {
    json!({"body": body, "at": [x, y, 0.0]})
}

/// Radial clearance of a joint.
pub fn disc(joint: usize, radius: f64) -> Value {
    json!({"kind": "clearance", "joint": joint, "set": {"disc": {"radius": radius}}, "centre": [0, 0], "law": "uniform"})
}
