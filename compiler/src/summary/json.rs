//! The finished design in figures, for machines.
//!
//! One object; numbers are as the design has them, in the user's units, `null` where there is no such figure.
//!
//! | key | holds |
//! |---|---|
//! | `name`, `sample_time`, `horizon`, `scalar` | what the file says, or the command line instead |
//! | `assumptions` | `rho_F`, `rank_margin`, `rho_calF`, `rho_small_gain`: margins of Assumptions 1 to 4, radii are below 1 |
//! | `epsilon`, `epsilon_given` | largest step of a reference (6), and whether the file states it |
//! | `subsystems` | see below, in the order of the file |
//! | `coupling_constraints` | `name`, `limit`, and `references`: what (26) leaves of it |
//! | `slacks` | the smallest of every inclusion: `equation`, `what`, `value` |
//! | `trade` | other reserves: `reserve` and `y_volume`, both relative to this design, `epsilon` |
//! | `start_steps` | steps of the start-up plan |
//! | `notices` | sentences: what is worth a second look |
//!
//! Of a subsystem: `name`; `rho_F`, spectral radius of its local loop; `set_points`, per output `output`, `unit`, `min`, `max`,
//! and `min_limited_by`, `max_limited_by`, the row (25b) that this end meets first if it moves on alone, `row` and `room`;
//! `reserve`, per coupling output `output`, `delta_z` (22), `zeta` (21); `facets` of `E` and `Sigma`; `unknowns`, `rows`,
//! `inequalities` and `inequalities_before` of the i-DPC problem; `max_iterations`; `table_bytes`.

use serde_json::{Value, json};

use super::Summary;
use crate::notices::notices;
use crate::sizing::{EndLimit, EndLimits, end_limits};

impl Summary<'_> {
    /// The same design gives the same object.
    pub fn to_json(&self) -> Value {
        let (network, sizing) = (&self.design.network, &self.design.sizing);
        let (gains, sets) = (&self.design.gains, &self.design.sets);
        let limits = end_limits(network, sets, sizing);
        let subsystems = (0..network.subsystems.len()).map(|i| self.subsystem_json(i, &limits[i]));
        json!({
            "name": network.name, "sample_time": network.sample_time, "horizon": network.horizon,
            "scalar": network.scalar.name(),
            "assumptions": {
                "rho_F": gains.rho_F, "rank_margin": gains.rank_margin, "rho_calF": gains.rho_calF,
                "rho_small_gain": sets.rho_small_gain,
            },
            "epsilon": sizing.epsilon, "epsilon_given": network.reference.epsilon.is_some(),
            "subsystems": subsystems.collect::<Vec<_>>(),
            "coupling_constraints": self.coupling_json(),
            "slacks": self.slacks_json(),
            "trade": self.trade_json(),
            "start_steps": self.design.start.as_ref().map(|plan| plan.steps),
            "notices": notices(self.design),
        })
    }

    fn subsystem_json(&self, i: usize, limits: &[EndLimits]) -> Value {
        let (model, sized) = (&self.design.network.subsystems[i], &self.design.sizing.subsystems[i]);
        let dpc = &self.design.problems.subsystems[i].dpc;
        let end = |limit: &EndLimit| json!({ "row": limit.row, "room": limit.room });
        let set_points = model.outputs.iter().enumerate().map(|(k, output)| {
            json!({
                "output": output.name, "unit": output.unit, "min": sized.Y.min[k], "max": sized.Y.max[k],
                "min_limited_by": end(&limits[k].low), "max_limited_by": end(&limits[k].high),
            })
        });
        let reserve = model.coupling_outputs.iter().zip(sized.dz.iter().zip(&sized.zeta));
        let reserve = reserve.map(|(output, (dz, zeta))| json!({ "output": output, "delta_z": dz, "zeta": zeta }));
        json!({
            "name": model.name, "rho_F": self.design.gains.subsystems[i].rho_F,
            "set_points": set_points.collect::<Vec<_>>(), "reserve": reserve.collect::<Vec<_>>(),
            "facets": { "E": sized.E.facets(), "Sigma": sized.Sigma.facets() },
            "unknowns": dpc.H.nrows(), "rows": dpc.rows.len(),
            "inequalities": dpc.facets_after, "inequalities_before": dpc.facets_before,
            "max_iterations": dpc.max_iterations, "table_bytes": self.emitted.table_bytes[i],
        })
    }

    fn coupling_json(&self) -> Vec<Value> {
        let rows = self.design.network.coupling_constraints.iter().zip(&self.design.sizing.l_tilde);
        rows.map(|(row, l_tilde)| json!({ "name": row.name, "limit": row.l, "references": l_tilde })).collect()
    }

    fn slacks_json(&self) -> Vec<Value> {
        let slacks = self.smallest_slacks();
        let object = |slack: &&crate::sizing::Slack| json!({ "equation": slack.equation, "what": slack.what, "value": slack.value });
        slacks.iter().map(object).collect()
    }

    fn trade_json(&self) -> Vec<Value> {
        let points = self.design.sizing.trade.iter();
        let object = |point: &crate::sizing::TradePoint| json!({ "reserve": point.reserve, "y_volume": point.y_volume, "epsilon": point.epsilon });
        points.map(object).collect()
    }
}
