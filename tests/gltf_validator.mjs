// Runs the Khronos glTF validator over files: node tests/gltf_validator.mjs FILE.glb...
// The npm package `gltf-validator` is looked up from the current folder. Status 1 if any file has an error.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join } from "node:path";

const validator = createRequire(join(process.cwd(), "index.js"))("gltf-validator");
const SEVERITIES = ["error", "warning", "info", "hint"];
let errors = 0;
for (const file of process.argv.slice(2)) {
  const { issues } = await validator.validateBytes(new Uint8Array(await readFile(file)));
  console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos`);
  for (const { severity, code, pointer, message } of issues.messages) {
    console.log(`  ${SEVERITIES[severity]} ${code} at ${pointer}: ${message}`);
  }
  errors += issues.numErrors;
}
process.exitCode = errors > 0 ? 1 : 0;
