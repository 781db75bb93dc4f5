// Bundles the page and writes it as one C++ file of compressed bytes, which the program serves.
// Usage: node build.mjs OUTPUT.cpp, in a folder with src, generated and node_modules.
import { readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";
import { gzipSync } from "fflate"; // gives the same bytes with each version of Node

const [output] = process.argv.slice(2);
const pack = (bytes) => gzipSync(bytes, { level: 9, mtime: 0 });
// The licences of what is bundled want their notices with it.
const notices = [
  ["three", "LICENSE"],
  ["uplot", "LICENSE"],
  ["dockview", "LICENCE.md"],
]
  .map(
    ([name, file]) =>
      `${name}\n\n${readFileSync(`node_modules/${name}/${file}`, "utf8").trim().replaceAll("*/", "* /")}`,
  )
  .join("\n\n");
const bundle = await build({
  entryPoints: { main: "src/main.ts" },
  outdir: "out",
  write: false,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  footer: { js: `/*!\n${notices}\n*/` },
  preserveSymlinks: true,
  logLevel: "warning",
});
const kTypes = {
  js: "text/javascript; charset=utf-8",
  css: "text/css; charset=utf-8",
  html: "text/html; charset=utf-8",
  svg: "image/svg+xml",
};
const files = [
  ["/", "src/index.html"],
  ["/icon.svg", "src/icon.svg"],
].map(([path, name]) => ({ path, name, bytes: readFileSync(name) }));
for (const file of bundle.outputFiles) {
  const name = file.path.replace(/^.*[/\\]/, "");
  files.push({ path: `/${name}`, name, bytes: Buffer.from(file.contents) });
}
let code =
  '// The web page, made by web/build.mjs.\n#include "console/assets.h"\n\nnamespace ruedo::console {\nnamespace {\n';
const entries = files.map(({ path, name, bytes }, index) => {
  const packed = pack(bytes);
  const rows = [];
  for (let at = 0; at < packed.length; at += 32)
    rows.push([...packed.subarray(at, at + 32)].join(","));
  code += `const uint8_t kFile${index}[] = {\n${rows.join(",\n")}};\n`;
  return `    {"${path}", "${kTypes[name.replace(/^.*\./, "")]}", kFile${index}, sizeof kFile${index}},\n`;
});
// The page as a file that needs no server: all in one, the program compressed. A log follows it,
// and then the end of the body.
const text = (name) => files.find((file) => file.name === name).bytes.toString("utf8");
const boot = `const bytes = Uint8Array.from(atob(document.getElementById("code").textContent), (c) => c.charCodeAt(0));
const script = document.createElement("script");
script.type = "module";
script.textContent = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
document.body.append(script);`;
const parts = {
  "/icon.svg": `data:image/svg+xml;base64,${Buffer.from(text("src/icon.svg")).toString("base64")}`,
  '<link rel="stylesheet" href="/main.css" />': `<style>${text("main.css")}</style>`,
  '<script type="module" src="/main.js"></script>': `<script type="text/plain" id="code">${Buffer.from(pack(Buffer.from(text("main.js")))).toString("base64")}</script>\n<script type="module">${boot}</script>`,
};
let alone = text(files[0].name).replace(/<\/body>[^]*$/, "");
for (const [link, content] of Object.entries(parts)) {
  if (!alone.includes(link)) throw new Error(`index.html has no ${link}`);
  alone = alone.replace(link, () => content);
}
const shell = Buffer.from(alone);
code += "const uint8_t kShellBytes[] = {";
for (let at = 0; at < shell.length; at += 32)
  code += `${[...shell.subarray(at, at + 32)].join(",")},\n`;
code += "};\n";
code += `}  // namespace\n\nconst uint8_t* const kShell = kShellBytes;\nconst size_t kShellSize = sizeof kShellBytes;\n\nconst Asset kAssets[] = {\n${entries.join("")}};\nconst size_t kAssetCount = ${entries.length};\n\n}  // namespace ruedo::console\n`;
writeFileSync(output, code);
