//! `[[tasks.limits]]` and `[[tasks.curves]]`: quantities that are followed along plans.

use serde::Deserialize;
use supple_model::Value;
use supple_model::document::{Document, FileError, Place, merged};
use supple_model::followed::Followed;
use supple_model::quantity::{Context, Kinds, Quantity, Unfit};
use supple_model::value::OneOrMore;
use supple_text::digits;

/// The keys of a limit beside those of its quantity.
const KEYS: &[&str] = &["lower", "upper", "enforce"];

/// What a limit has beside its quantity.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct LimitFile {
    /// The least that it may be, one number for all entries or one each, in its units; default: none.
    lower: Option<OneOrMore>,
    /// The most that it may be, one number for all entries or one each, in its units; default: none.
    upper: Option<OneOrMore>,
    /// Whether plans enforce the limit, or violations are only reported.
    #[serde(default)]
    enforce: bool,
}

/// The quantities that a task follows: its limits, then its curves.
pub(super) fn read(document: &Document, task: usize, context: &Context) -> Result<Vec<Followed>, FileError> {
    let mut followed = Vec::new();
    for key in ["limits", "curves"] {
        let list = ["tasks".into(), task.into(), key.into()];
        for index in 0..document.tables(&list)? {
            let at: Vec<Place> = list.iter().copied().chain([index.into()]).collect();
            let reader = Reader { document, at: &at, context };
            followed.push(if key == "limits" { reader.limit()? } else { reader.curve()? });
        }
    }
    Ok(followed)
}

struct Reader<'a> {
    document: &'a Document<'a>,
    at: &'a [Place<'a>],
    context: &'a Context<'a>,
}

impl Reader<'_> {
    fn error(&self, key: &'static str, message: impl Into<String>) -> FileError {
        Unfit::new(key, message).at(self.document, self.at)
    }

    fn quantity(&self, beside: &'static [&'static str]) -> Result<Quantity, FileError> {
        let (kind, table) = self.document.table_with_kind(self.at, &self.context.kinds.names())?;
        self.context.read(kind, table.beside(beside), self.document.spot(self.at))
    }

    fn curve(&self) -> Result<Followed, FileError> {
        self.quantity(&[]).map(Followed::curve)
    }

    fn limit(&self) -> Result<Followed, FileError> {
        let quantity = self.quantity(KEYS)?;
        let (_, table) = self.document.table_with_kind(self.at, &self.context.kinds.names())?;
        let file = LimitFile::deserialize(table.only(KEYS));
        let LimitFile { lower, upper, enforce } = file.map_err(|error| self.document.read_error(self.at, error))?;
        if lower.is_none() && upper.is_none() {
            return Err(self.error("upper", "is missing: a limit requires `lower`, `upper`, or both"));
        }
        let side = |key: &'static str, given: Option<OneOrMore>, none: f64| {
            let given = given.unwrap_or(OneOrMore(vec![Value::Number(none)]));
            given.each(quantity.len()).map_err(|wrong| self.error(key, wrong.to_string()))
        };
        let limits = [side("lower", lower, f64::NEG_INFINITY)?, side("upper", upper, f64::INFINITY)?];
        let phi = self.context.parameters.initial();
        for (lower, upper) in limits[0].iter().zip(&limits[1]) {
            let [least, most] = [lower, upper].map(|value| value.resolve::<f64>(&phi));
            if least > most {
                let message = format!("must be at most `upper`, {}; found {}", digits(most), digits(least));
                return Err(self.error("lower", message));
            }
        }
        Ok(Followed { limits: Some(limits), enforced: enforce, ..Followed::curve(quantity) })
    }
}

/// The schema of each kind's table, of limits or of curves, by name.
pub(super) fn schemas(
    kinds: &Kinds,
    generator: &mut schemars::SchemaGenerator,
    limits: bool,
) -> Vec<(&'static str, schemars::Schema)> {
    let common = <LimitFile as schemars::JsonSchema>::json_schema(generator);
    let of_quantities = kinds.schemas(generator).into_iter();
    of_quantities.map(|(kind, own)| (kind, if limits { merged(own, &common) } else { own })).collect()
}
