//! `[catalogue]`: sensors that a robot may have or not, in the task file or in a table of comma-separated values.

use std::path::PathBuf;
use std::rc::Rc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::IgnoredAny;
use supple::CatalogueSensor;
use supple_model::Channel;
use supple_model::document::{Content, Document, Place, Spanned, Table};
use supple_model::model::{AnyModel, Entry, Equipment, Source};
use supple_model::noise::with_deviation;
use supple_model::parameters::Parameters;
use supple_model::quantity::{Context, Kinds, Noise, Vocabulary, read_sensor, sensor_schemas};
use supple_model::value::{Names, OneOrMore, Value};
use supple_text::{FileError, digits, nearest, quoted};

use crate::csv_table::{CsvRow, CsvTable};

/// Which sensors of a catalogue to include when reading a problem.
///
/// Example: [`load_with`](crate::load_with).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WithSensors {
    /// Those that the file says are chosen: what a robot has.
    #[default]
    Chosen,
    /// All of them: what it may have.
    All,
}

/// `[catalogue]`: sensors to choose from.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct CatalogueFile {
    /// Names of the model's measurements that are always present; default: all.
    base: Option<Vec<String>>,
    /// Names of the sensors that the robot has; default: none.
    #[serde(default)]
    chosen: Vec<String>,
    /// The sensors: a list of tables, each with a `kind`, or the name of a file with one line for each.
    #[schemars(skip)]
    #[allow(dead_code)]
    sensors: IgnoredAny,
}

/// What every sensor of a catalogue has.
#[derive(Debug, Deserialize)]
struct CommonFile {
    name: String,
    #[serde(default)]
    price: f64,
}

/// Its keys.
const COMMON: &[&str] = &["name", "price"];

/// Kinds of sensors beside those that measure a quantity.
const OWN_KINDS: [&str; 2] = ["measurement", "sum"];

/// A sensor of measurements of the model itself.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NamedFile {
    /// Names of what is measured.
    select: Vec<String>,
    /// Variance of the noise, one for all or one each, in squares of the unit; above 0.
    variance: OneOrMore,
}

/// A sensor of sums of states.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub(super) struct SumFile {
    /// Factors of the states, one row per measurement.
    C: Vec<Vec<Value>>,
    /// Variance of the noise, one for all or one each; above 0.
    variance: OneOrMore,
}

/// The schema of each kind of sensor, by name.
pub(super) fn schemas(
    kinds: &Kinds,
    generator: &mut schemars::SchemaGenerator,
) -> Vec<(&'static str, schemars::Schema)> {
    let own = [
        ("measurement", with_deviation(NamedFile::json_schema(generator))),
        ("sum", with_deviation(SumFile::json_schema(generator))),
    ];
    own.into_iter().chain(sensor_schemas(kinds, generator)).collect()
}

/// What a catalogue is and which files it is in.
pub(super) type Read = (Option<Vec<CatalogueSensor>>, Vec<PathBuf>);

/// Reads `[catalogue]`, if there is one, and adds its selected sensors to the model.
pub(super) fn equip(
    source: &Source,
    model: Box<dyn AnyModel>,
    which: WithSensors,
) -> Result<(Box<dyn AnyModel>, Read), FileError> {
    let &Source { document, parameters, folder, .. } = source;
    let kinds = &source.kinds.quantities;
    let at = ["catalogue".into()];
    if document.get(&at).is_none() {
        let equipment = Equipment::of(&*model);
        let model = if equipment.added.is_empty() { model } else { model.equipped(equipment) };
        return Ok((model, (None, Vec::new())));
    }
    let file: CatalogueFile = document.read(&at)?;
    let place = ["catalogue".into(), "sensors".into()];
    let Some(Content::Text(name)) = document.get(&place).map(|value| value.get_ref()) else {
        let building = Building { document, top: document, at: place.to_vec(), parameters, kinds, which };
        let (model, sensors) = building.build(&file, model)?;
        return Ok((model, (Some(sensors), Vec::new())));
    };
    let path = folder.join(name.as_ref());
    let shown = path.display().to_string();
    let text = document.files().read(&path).map_err(|error| document.error_of_file(&place, error))?;
    let table = CsvTable::parse(&text, &shown)?;
    let table = as_document(&table, document.names());
    let building = Building { document: &table, top: document, at: vec!["sensors".into()], parameters, kinds, which };
    let (model, sensors) = building.build(&file, model)?;
    Ok((model, (Some(sensors), vec![path])))
}

/// A table of comma-separated values as a list `sensors` of tables, whose keys are the columns; empty cells are left
/// out.
fn as_document<'a>(table: &'a CsvTable<'a>, names: Option<Rc<Names>>) -> Document<'a> {
    let one = |row: &'a CsvRow| {
        let mut sensor = Table::new();
        let cells = table.header.cells.iter().zip(row.cells.iter().zip(table.spans(row)));
        for (column, (cell, span)) in cells.filter(|(_, (cell, _))| !cell.is_empty()) {
            let value = Spanned::new(span.clone(), Content::Text(cell.into()));
            sensor.insert(Spanned::new(span, column.into()), value);
        }
        Spanned::new(row.span.clone(), Content::Table(sensor))
    };
    let sensors = table.rows.iter().map(one).collect();
    let mut root = Table::new();
    root.insert(Spanned::new(0..0, "sensors".into()), Spanned::new(0..0, Content::List(sensors)));
    let document = Document::of_cells(table.name, table.text, root);
    match names {
        Some(names) => document.naming(names),
        None => document,
    }
}

/// Reads the sensors of a catalogue.
struct Building<'a> {
    /// What they are in.
    document: &'a Document<'a>,
    /// The task file.
    top: &'a Document<'a>,
    /// Where they are in it.
    at: Vec<Place<'a>>,
    parameters: &'a Parameters,
    kinds: &'a Kinds,
    which: WithSensors,
}

impl Building<'_> {
    fn error(&self, index: usize, key: &str, message: impl Into<String>) -> FileError {
        let at: Vec<Place> = self.at.iter().copied().chain([index.into(), Place::Key(key)]).collect();
        self.document.error(&at, message)
    }

    fn build(
        &self,
        file: &CatalogueFile,
        model: Box<dyn AnyModel>,
    ) -> Result<(Box<dyn AnyModel>, Vec<CatalogueSensor>), FileError> {
        let count = self.document.tables(&self.at)?;
        if count == 0 {
            return Err(self.document.error(&self.at, "must have one or more sensors: [[catalogue.sensors]]"));
        }
        let (own, vocabulary) = (model.channels().measurements, model.vocabulary());
        let all = Equipment::of(&*model);
        let recalled = all.added.iter().map(|(_, channel, _)| channel.clone());
        let offered: Vec<Channel> = own.iter().cloned().chain(recalled).collect();
        let kept = self.kept(file, &offered)?;
        let mut equipment = all.keeping(&kept);
        let mut sensors: Vec<CatalogueSensor> = Vec::with_capacity(count);
        for index in 0..count {
            let (common, kind) = self.common(index, &sensors)?;
            let entries = self.entries(index, &kind, &common.name, &vocabulary, &own)?;
            let chosen = file.chosen.contains(&common.name);
            let mut rows = Vec::new();
            if chosen || self.which == WithSensors::All {
                let first = equipment.kept.len() + equipment.added.len();
                rows = (first..first + entries.len()).collect();
                equipment.added.extend(entries);
            }
            sensors.push(CatalogueSensor { name: common.name, kind, price: common.price, chosen, rows });
        }
        for (place, name) in file.chosen.iter().enumerate() {
            if file.chosen[..place].contains(name) {
                let at = ["catalogue".into(), "chosen".into(), place.into()];
                return Err(self.top.error(&at, format!("`{name}` occurs twice")));
            }
            if !sensors.iter().any(|sensor| sensor.name == *name) {
                let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name.as_str()).collect();
                let at = ["catalogue".into(), "chosen".into(), place.into()];
                let message = format!("the catalogue has no sensor `{name}`; valid: {}", quoted(&names));
                return Err(FileError { help: nearest(name, &names), ..self.top.error(&at, message) });
            }
        }
        Ok((model.equipped(equipment), sensors))
    }

    /// The model's own measurements that are kept.
    fn kept(&self, file: &CatalogueFile, own: &[Channel]) -> Result<Vec<usize>, FileError> {
        let Some(base) = &file.base else { return Ok((0..own.len()).collect()) };
        let names: Vec<&str> = own.iter().map(|channel| channel.name.as_str()).collect();
        let find = |(place, name): (usize, &String)| {
            names.iter().position(|other| other == name).ok_or_else(|| {
                let at = ["catalogue".into(), "base".into(), place.into()];
                let message = format!("the model has no measurement `{name}`: it has {}", quoted(&names));
                FileError { help: nearest(name, &names), ..self.top.error(&at, message) }
            })
        };
        let mut kept = base.iter().enumerate().map(find).collect::<Result<Vec<_>, _>>()?;
        kept.sort_unstable();
        kept.dedup();
        Ok(kept)
    }

    /// What every sensor has, and its kind.
    fn common(&self, index: usize, before: &[CatalogueSensor]) -> Result<(CommonFile, String), FileError> {
        let at: Vec<Place> = self.at.iter().copied().chain([index.into()]).collect();
        let kinds: Vec<&str> = OWN_KINDS.into_iter().chain(self.kinds.names()).collect();
        let (kind, table) = self.document.table_with_kind(&at, &kinds)?;
        if !kinds.contains(&kind) {
            return Err(self.document.unknown_kind(&at, kind, &kinds));
        }
        let common = CommonFile::deserialize(table.only(COMMON));
        let common = common.map_err(|error| self.document.read_error(&at, error))?;
        if common.name.is_empty() {
            return Err(self.error(index, "name", "must not be empty"));
        }
        if before.iter().any(|other| other.name == common.name) {
            return Err(self.error(index, "name", format!("`{}` names two sensors", common.name)));
        }
        if !(common.price >= 0.0 && common.price.is_finite()) {
            return Err(self.error(index, "price", format!("must be at least 0; found {}", digits(common.price))));
        }
        Ok((common, kind.to_owned()))
    }

    /// What a sensor measures, with its noise.
    fn entries(
        &self,
        index: usize,
        kind: &str,
        name: &str,
        vocabulary: &Vocabulary,
        own: &[Channel],
    ) -> Result<Vec<(Entry, Channel, Value)>, FileError> {
        let at: Vec<Place> = self.at.iter().copied().chain([index.into()]).collect();
        let (_, table) = self.document.table_with_kind(&at, &[])?;
        let table = table.beside(COMMON);
        if !OWN_KINDS.contains(&kind) {
            let context = Context { kinds: self.kinds, vocabulary, parameters: self.parameters };
            let sensor = read_sensor(kind, table, self.document.spot(&at), &context)?;
            return Ok(Equipment::entries(&sensor));
        }
        let (noise, table) = Noise::of(table, self.document.spot(&at))?;
        let channel = |number: usize| Channel::new(format!("{name} {}", number + 1), "");
        let (entries, variance): (Vec<(Entry, Channel)>, OneOrMore) = if kind == "sum" {
            let file = SumFile::deserialize(table).map_err(|error| self.document.read_error(&at, error))?;
            let states = vocabulary.states.len();
            if let Some(row) = file.C.iter().find(|row| row.len() != states) {
                let message = format!("must have one factor per state: {states}; found {}", row.len());
                return Err(self.error(index, "C", message));
            }
            let entries = file.C.into_iter().enumerate().map(|(number, row)| (Entry::Sum(row), channel(number)));
            (entries.collect(), file.variance)
        } else {
            let file = NamedFile::deserialize(table).map_err(|error| self.document.read_error(&at, error))?;
            (self.selected(index, &file.select, own)?, file.variance)
        };
        if entries.is_empty() {
            return Err(self.error(index, if kind == "sum" { "C" } else { "select" }, "name at least one"));
        }
        let variances = noise.variances(variance, entries.len(), self.parameters)?;
        Ok(entries.into_iter().zip(variances).map(|((entry, channel), v)| (entry, channel, v)).collect())
    }

    /// Measurements of the model by name.
    fn selected(&self, index: usize, select: &[String], own: &[Channel]) -> Result<Vec<(Entry, Channel)>, FileError> {
        let names: Vec<&str> = own.iter().map(|channel| channel.name.as_str()).collect();
        let find = |name: &String| match names.iter().position(|other| other == name) {
            Some(place) => Ok((Entry::Own(place), own[place].clone())),
            None => {
                let message = format!("there is no measurement `{name}`; valid: {}", quoted(&names));
                Err(FileError { help: nearest(name, &names), ..self.error(index, "select", message) })
            }
        };
        select.iter().map(find).collect()
    }
}
