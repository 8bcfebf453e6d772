//! `spectral export`: a scene as binary glTF.

use crate::args::ExportArgs;
use crate::error::CliError;
use crate::{scene_argument, targets};

pub(crate) fn run(args: &ExportArgs) -> Result<(), CliError> {
    let file = targets::glb(&args.output)?;
    let scene = scene_argument::open(&args.scene)?.scene;
    let bytes = spectral_scene::to_glb(&scene).map_err(CliError::failed)?;
    file.write(|content| content.write_all(&bytes)).map_err(|error| CliError::write(&args.output, &error))
}
