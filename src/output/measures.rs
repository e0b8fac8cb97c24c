//! What a scene asked to be measured, as files: `measures/NAME/` with tables, pictures and fields for ParaView.

use super::tables::table;
use super::{Error, Folder, plots, vtk};
use crate::observe::measure::Results;

/// Writes the results of the measurement called `name`.
///
/// # Errors
/// What could not be written.
pub(super) fn write(folder: &Folder, name: &str, results: &Results, pictures: bool) -> Result<(), Error> {
    let file = |of: &str, ending: &str| format!("measures/{name}/{of}.{ending}");
    for numbers in &results.tables {
        folder.write(&file(numbers.name, "csv"), |out| table(out, numbers.columns, numbers.rows.iter()))?;
    }
    if let Some(fields) = &results.fields {
        folder.write(&file("fields", "vti"), |out| vtk::write_fields(out, fields))?;
    }
    if let Some(facets) = &results.facets {
        folder.write(&file("patches", "vtp"), |out| vtk::write_facets(out, facets))?;
    }
    for picture in results.pictures.iter().filter(|_| pictures) {
        let name = file(picture.name(), "svg");
        let svg = plots::drawn(picture).map_err(folder.failed(&name))?;
        folder.write(&name, |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(())
}
