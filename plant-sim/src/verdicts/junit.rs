//! JUnit XML: a test case for the end of the run and one for each requirement.

use std::time::Duration;

use quick_junit::{NonSuccessKind, Property, Report, TestCase, TestCaseStatus, TestSuite};

use super::{ending, finding, limit};
use crate::run::Results;

/// The results as JUnit XML.
///
/// # Panics
/// Never: texts can be written.
pub fn junit(results: &Results) -> String {
    let summary = &results.summary;
    let scenario = &summary.recipe.scenario;
    let mut suite = TestSuite::new(scenario.as_str());
    suite.set_time(Duration::from_secs_f64(results.wall_time_s));
    suite.add_property(Property::new("law", summary.recipe.law.as_str()));
    suite.add_property(Property::new(
        "payload_kg",
        summary.recipe.payload_kg.to_string(),
    ));
    if let Some(hash) = &results.trace_sha256 {
        suite.add_property(Property::new("trace_sha256", hash.as_str()));
    }
    let mut add = |name: &str, found: Result<String, String>| {
        let (status, out) = match found {
            Ok(text) => (TestCaseStatus::success(), Some(text)),
            Err(text) => {
                let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
                status.set_message(text);
                (status, None)
            }
        };
        let mut case = TestCase::new(name, status);
        case.set_classname(scenario.as_str());
        if let Some(out) = out {
            case.set_system_out(out);
        }
        suite.add_test_case(case);
    };
    add("end of the run", ending(summary));
    for verdict in &summary.requirements {
        let text = format!("{}: {}", limit(&verdict.requirement), finding(verdict));
        add(
            &verdict.requirement.id,
            if verdict.met { Ok(text) } else { Err(text) },
        );
    }
    for (case, verdict) in suite
        .test_cases
        .iter_mut()
        .skip(1)
        .zip(&summary.requirements)
    {
        let requirement = &verdict.requirement;
        case.add_property(Property::new("requirement", requirement.id.as_str()));
        case.add_property(Property::new("text", requirement.text.as_str()));
        if let Some(margin) = verdict.margin {
            case.add_property(Property::new("margin", margin.to_string()));
        }
    }
    let mut report = Report::new("plant-sim");
    report.add_test_suite(suite);
    report.to_string().expect("texts can be written as XML")
}
