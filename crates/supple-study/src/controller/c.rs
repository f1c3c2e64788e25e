//! A controller as C99: tables, and functions that allocate nothing.

use std::fmt::Write;

use supple::lqg::ControlBounds;
use supple::{Channel, Controller, Dimensions, Matrices, Rows, time_of};

use super::exported::ExportedController;
use super::file::columns;
use super::names;
use crate::StudyError;

/// A controller as the texts of two files.
///
/// Example: the [module](crate::controller).
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct CSource {
    /// The header: what the functions are, and what the numbers mean.
    pub header: String,
    /// The source: tables and functions.
    pub source: String,
}

/// Constant tables of numbers, and how many bytes they take.
#[derive(Default)]
struct Tables {
    text: String,
    bytes: usize,
}

impl CSource {
    /// Of a controller; `header` is the name of the header's file.
    ///
    /// # Errors
    /// Where the task has no control.
    pub fn of(exported: &ExportedController, header: &str) -> Result<Self, StudyError> {
        let controller = &exported.controller;
        if controller.dimensions.controls == 0 || controller.steps() == 0 {
            let message = format!("task `{}` has no controls: there is nothing to run", exported.task.name);
            return Err(StudyError::usage(message));
        }
        let name = exported.name();
        let mut tables = Tables::default();
        let step = step(controller, &name, &mut tables);
        let source = format!(
            "/* Controller of task `{}`. {} says what it computes. */\n\n#include <math.h>\n\n#include \"{header}\"\n\n{}{step}",
            names::comment(&exported.task.name),
            names::comment(header),
            tables.text,
        );
        Ok(Self { header: declarations(exported, &name, tables.bytes), source })
    }
}

impl Tables {
    /// A table of one flat matrix per step; one for all steps where they are equal. How C names the matrix of step `t`.
    fn add(&mut self, name: &str, matrices: &[Rows]) -> String {
        let constant = matrices.iter().all(|matrix| matrix == &matrices[0]);
        let kept = if constant { &matrices[..1] } else { matrices };
        let size = matrices[0].iter().map(Vec::len).sum::<usize>();
        self.bytes += size_of::<f64>() * size * kept.len();
        // Nothing can go wrong in writing to a text.
        let _ = writeln!(self.text, "static const double {name}[{}][{size}] = {{", kept.len());
        for matrix in kept {
            // The fewest digits that read back to the same bits.
            let rows =
                matrix.iter().map(|row| row.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(", "));
            let _ = writeln!(self.text, "    {{{}}},", rows.collect::<Vec<_>>().join(",\n     "));
        }
        self.text.push_str("};\n\n");
        format!("{name}[{}]", if constant { "0" } else { "t" })
    }
}

/// The functions; their tables are added to `tables`.
fn step(controller: &Controller, name: &str, tables: &mut Tables) -> String {
    let Dimensions { states: n, controls: m, measurements: p } = controller.dimensions;
    let upper = name.to_ascii_uppercase();
    let steps = controller.steps();
    let whole = |matrices: &Matrices| columns(matrices, steps, 0..matrices.cols());
    let correction = if p > 0 { correction(controller, tables) } else { String::new() };
    let controls = tables.add("controls", &whole(&controller.trajectory.controls));
    let feedforward = tables.add("feedforward", &whole(&controller.feedforward));
    let feedback = tables.add("feedback", &whole(&controller.feedback));
    let dynamics = tables.add("dynamics", &columns(&controller.dynamics, steps, 0..n));
    let input = tables.add("input", &columns(&controller.dynamics, steps, n..n + m));
    let clip = controller.bounds.as_ref().map_or("", |bounds| clip(bounds, tables));
    let (local, check, unused) = if p > 0 {
        let check = format!(
            "    for (i = 0; i < {p}; i++) {{\n        if (!isfinite(y[i])) return {upper}_NOT_FINITE;\n    }}\n"
        );
        (format!("innovation[{p}], "), check, "")
    } else {
        (String::new(), String::new(), "    (void)y;\n")
    };
    format!(
        "void {name}_init({name}_controller *controller)
{{
    int i;
    controller->step = 0;
    for (i = 0; i < {n}; i++) controller->deviation[i] = 0.0;
}}

int {name}_step({name}_controller *controller, const double *y, double *u)
{{
    double {local}change[{m}], next[{n}], sum;
    double *d = controller->deviation;
    const int t = controller->step;
    int i, j;

{unused}    if (t < 0 || t >= {upper}_STEPS) return {upper}_OVER;
{check}
{correction}    for (i = 0; i < {m}; i++) {{
        sum = 0.0;
        for (j = 0; j < {n}; j++) sum += {feedback}[i * {n} + j] * d[j];
        u[i] = {controls}[i] + {feedforward}[i] + sum;
{clip}        change[i] = u[i] - {controls}[i];
    }}
    for (i = 0; i < {n}; i++) {{
        sum = 0.0;
        for (j = 0; j < {n}; j++) sum += {dynamics}[i * {n} + j] * d[j];
        for (j = 0; j < {m}; j++) sum += {input}[i * {m} + j] * change[j];
        next[i] = sum;
    }}
    for (i = 0; i < {n}; i++) d[i] = next[i];
    controller->step = t + 1;
    return {upper}_OK;
}}
"
    )
}

/// The code that corrects the expected deviation by a measurement; its tables are added to `tables`.
fn correction(controller: &Controller, tables: &mut Tables) -> String {
    let Dimensions { states: n, measurements: p, .. } = controller.dimensions;
    let whole = |matrices: &Matrices| columns(matrices, controller.steps(), 0..matrices.cols());
    let expected = tables.add("expected", &whole(&controller.expected));
    let measurement = tables.add("measurement", &whole(&controller.measurement));
    let filter_gain = tables.add("filter_gain", &whole(&controller.filter_gain));
    format!(
        "    for (i = 0; i < {p}; i++) {{
        sum = 0.0;
        for (j = 0; j < {n}; j++) sum += {measurement}[i * {n} + j] * d[j];
        innovation[i] = y[i] - {expected}[i] - sum;
    }}
    for (i = 0; i < {n}; i++) {{
        sum = 0.0;
        for (j = 0; j < {p}; j++) sum += {filter_gain}[i * {p} + j] * innovation[j];
        d[i] += sum;
    }}
"
    )
}

/// The code that keeps a control within its bounds, which are added to `tables`.
fn clip(bounds: &ControlBounds, tables: &mut Tables) -> &'static str {
    for (what, bounds) in [("lower", bounds.lower()), ("upper", bounds.upper())] {
        let numbers = bounds.iter().map(|&bound| number_of_bound(bound)).collect::<Vec<_>>().join(", ");
        let _ = writeln!(tables.text, "static const double {what}[{}] = {{{numbers}}};", bounds.len());
        tables.bytes += size_of_val(bounds);
    }
    tables.text.push('\n');
    "        if (u[i] < lower[i]) u[i] = lower[i];\n        if (u[i] > upper[i]) u[i] = upper[i];\n"
}

/// A bound as C writes it.
fn number_of_bound(bound: f64) -> String {
    match bound {
        f64::INFINITY => "HUGE_VAL".to_owned(),
        f64::NEG_INFINITY => "-HUGE_VAL".to_owned(),
        bound => format!("{bound:?}"),
    }
}

/// Additions, subtractions and multiplications of a step.
fn operations(Dimensions { states: n, controls: m, measurements: p }: Dimensions) -> usize {
    let correction = if p > 0 { p * (2 * n + 2) + n * (2 * p + 1) } else { 0 };
    correction + m * (2 * n + 3) + n * (2 * n + 2 * m)
}

/// The header.
fn declarations(exported: &ExportedController, name: &str, bytes: usize) -> String {
    let ExportedController { controller, task, status, time_step, channels, .. } = exported;
    let Dimensions { states: n, controls: m, measurements: p } = controller.dimensions;
    let (steps, upper) = (controller.steps(), name.to_ascii_uppercase());
    let places = |what: &str, channels: &[Channel]| -> String {
        let list = names::constants(&format!("{upper}_{what}_"), channels).into_iter().zip(channels).enumerate();
        list.map(|(place, (constant, channel))| {
            let unit = if channel.unit.is_empty() { "unit not known" } else { &channel.unit };
            let note = names::comment(&format!("{}, {unit}", channel.name));
            format!("#define {constant} {place} /* {note} */\n")
        })
        .collect()
    };
    format!(
        "/* Controller of task `{title}`: a linear, time-varying Kalman filter and control law around the plan.
 *
 * Written by supple {version}. Status of the plan: {status}.
 *
 * Time step: {time_step:?} s. Horizon: {steps} steps, {horizon:?} s.
 * States: {n}. Controls: {m}. Measurements: {p}.
 * Tables: {bytes} bytes of constant data.
 * State: {state} bytes, where a double has 8 and is aligned to 8.
 * Work: {operations} floating-point additions and multiplications per step.
 *
 * C99; allocates nothing and needs no library but the header math.h.
 */
#ifndef {upper}_CONTROLLER_H
#define {upper}_CONTROLLER_H

#ifdef __cplusplus
extern \"C\" {{
#endif

#define {upper}_TIME_STEP {time_step:?} /* s */
#define {upper}_STEPS {steps}
#define {upper}_MEASUREMENTS {p} /* length of y */
#define {upper}_CONTROLS {m} /* length of u */

/* Places in y. */
{measurements}
/* Places in u. */
{controls}
/* What {name}_step returns. */
#define {upper}_OK 0
#define {upper}_OVER 1 /* the plan has ended; u is not written */
#define {upper}_NOT_FINITE 2 /* y has a non-finite entry; the state is unchanged and u is not written */

/* State of the controller. Instances are independent. */
typedef struct {{
    int step; /* of the next measurement, from 0 */
    double deviation[{n}]; /* expected at the next measurement, from the plan's state */
}} {name}_controller;

/* Starts or restarts the plan. */
void {name}_init({name}_controller *controller);

/* One step: processes the measurement y and computes the controls u to apply until the next step. Returns a code above. */
int {name}_step({name}_controller *controller, const double *y, double *u);

#ifdef __cplusplus
}}
#endif

#endif
",
        title = names::comment(&task.name),
        version = env!("CARGO_PKG_VERSION"),
        horizon = time_of(steps, *time_step),
        state = 8 * (n + 1),
        operations = operations(controller.dimensions),
        measurements = places("Y", &channels.measurements),
        controls = places("U", &channels.controls),
    )
}
