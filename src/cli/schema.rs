//! `impinge schema`

use super::{Ending, Failure, print};

/// Prints the JSON schema of scene files, for editors and other programs.
pub(super) fn schema() -> Result<Ending, Failure> {
    print(&format!("{:#}\n", impinge::scene::schema()))?;
    Ok(Ending::Done)
}
