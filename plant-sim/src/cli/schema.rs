//! `plant-sim schema`: what files and JSON of this program look like.

use clap::{Args, ValueEnum};
use firmware::mechanics::arm::ArmModel;
use plant_sim::bench;
use plant_sim::campaign::cases::Cases;
use plant_sim::campaign::results::ResultLine;
use plant_sim::parameters::Row;
use plant_sim::reference::{markdown, of_input, of_output};
use plant_sim::run::Results;
use schemars::{Schema, schema_for_value};
use sim::model::RobotModel;
use sim::model::file::{ModelFile, PayloadFile};
use sim::rehearsal::Plan;
use sim::scenario::Scenario;
use trace::decode::JsonLine;
use trace::stats::Statistics;

use super::cost::Report;
use super::{Failure, show};

/// Arguments of `schema`.
#[derive(Args)]
pub(super) struct SchemaArgs {
    /// What to describe.
    #[arg(value_enum)]
    name: Name,
    /// Print tables for people, as the documents have them.
    #[arg(long)]
    markdown: bool,
}

/// What has a schema.
#[derive(Clone, Copy, ValueEnum)]
enum Name {
    /// A scenario file: run --scenario (TOML; the schema is of the same keys and values in JSON).
    Scenario,
    /// A model file: run --model and --plant-model.
    Model,
    /// A payload file: eval --payload.
    Payload,
    /// summary.json, and run --json.
    Summary,
    /// trace stats --json.
    Statistics,
    /// trace decode --format jsonl: one object on a line.
    Decoded,
    /// parameters --json.
    Parameters,
    /// check --json.
    Plan,
    /// cost --json.
    Cost,
    /// bench motion --json.
    MotionBench,
    /// A file of cases: campaign plan --cases (TOML; the schema is of the same keys and values in JSON).
    CampaignCases,
    /// A line of results of a campaign, but for the first: campaign run and merge.
    CampaignResult,
    /// A robot as controller --model takes it: what plant-sim model prints.
    ControllerModel,
}

impl Name {
    fn schema(self) -> Schema {
        match self {
            Self::Scenario => of_input::<Scenario>(),
            Self::Model => of_input::<ModelFile>(),
            Self::Payload => of_input::<PayloadFile>(),
            Self::Summary => of_output::<Results>(),
            Self::Statistics => of_output::<Statistics>(),
            Self::Decoded => of_output::<JsonLine>(),
            Self::Parameters => of_output::<Vec<Row>>(),
            Self::Plan => of_output::<Plan>(),
            Self::Cost => of_output::<Report>(),
            Self::MotionBench => of_output::<bench::Report>(),
            Self::CampaignCases => of_input::<Cases>(),
            Self::CampaignResult => of_output::<ResultLine>(),
            // The controller's own type knows nothing of schemas: one of its values shows what it is.
            Self::ControllerModel => {
                schema_for_value!(ArmModel::from(&RobotModel::irb_930_22_105()))
            }
        }
    }
}

/// Prints the schema.
pub(super) fn run(args: &SchemaArgs) -> Result<(), Failure> {
    let schema = args.name.schema();
    if args.markdown {
        show(&markdown(&schema))?;
    } else {
        let text = serde_json::to_string_pretty(&schema).map_err(|error| error.to_string())?;
        show(&(text + "\n"))?;
    }
    Ok(())
}
