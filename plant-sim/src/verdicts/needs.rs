//! needs.json, as sphinx-needs imports it: a need for each requirement, with its verdict as status.

use serde_json::{Map, Value, json};

use super::{finding, limit};
use crate::run::Results;

/// The requirements of a run as needs.json.
///
/// # Panics
/// Never: numbers and texts can be written.
pub fn needs(results: &Results) -> String {
    let summary = &results.summary;
    let need = |verdict: &sim::requirements::Verdict| {
        let requirement = &verdict.requirement;
        let content = format!("{}: {}", limit(requirement), finding(verdict));
        let need = json!({
            "id": requirement.id,
            "type": "req",
            "type_name": "Requirement",
            "title": requirement.text,
            "content": content,
            "status": if verdict.met { "passed" } else { "failed" },
            "tags": [summary.recipe.scenario],
        });
        (requirement.id.clone(), need)
    };
    let needs: Map<String, Value> = summary.requirements.iter().map(need).collect();
    let version = results.version;
    let file = json!({
        "project": "plant-sim",
        "current_version": version,
        "versions": { version: { "needs_amount": needs.len(), "needs": needs } },
    });
    serde_json::to_string_pretty(&file).expect("numbers and texts can be written") + "\n"
}
