// Runs the Khronos glTF validator: node tests/gltf_validator.mjs FILE... [--broken FILE...]
// Status 0 if no file has an error or a warning, and each file after --broken has one. The npm package `gltf-validator` is
// looked up from the current folder. `cargo xtask test` calls this.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { basename, join } from "node:path";

const validator = createRequire(join(process.cwd(), "index.js"))("gltf-validator");
const SEVERITIES = ["error", "warning", "info", "hint"];
const MOST_SHOWN = 10;

async function validate(file) {
  const { issues } = await validator.validateBytes(new Uint8Array(await readFile(file)));
  const serious = issues.messages.filter(({ severity }) => SEVERITIES.indexOf("warning") >= severity);
  const counts = `${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos`;
  return { name: basename(file), counts, isClean: issues.numErrors + issues.numWarnings === 0, serious };
}

const files = process.argv.slice(2);
const mark = files.includes("--broken") ? files.indexOf("--broken") : files.length;
const [whole, broken] = [files.slice(0, mark), files.slice(mark + 1)];
let failures = 0;
for (const [group, mustBeClean] of [[whole, true], [broken, false]]) {
  for (const file of group) {
    const { name, counts, isClean, serious } = await validate(file);
    if (isClean === mustBeClean) continue;
    failures += 1;
    console.log(mustBeClean ? `${name}: ${counts}` : `${name} is broken on purpose and was accepted: ${counts}`);
    for (const { severity, code, pointer, message } of serious.slice(0, MOST_SHOWN)) {
      console.log(`  ${SEVERITIES[severity]} ${code} at ${pointer}: ${message}`);
    }
  }
}
console.log(
  `glTF validator ${validator.version()}: ${whole.length} files, ${broken.length} broken on purpose, ${failures} failures`,
);
process.exitCode = failures > 0 ? 1 : 0;
