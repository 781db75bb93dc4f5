// Makes a description of the message types in TypeScript from proto/*.lcm: tables by which any
// message is read and written, interfaces against which the program is checked, and the types'
// constants. Usage: node generate.mjs PROTO_FOLDER OUTPUT.ts
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const [folder, output] = process.argv.slice(2);
const kPrimitives = new Map([
  ["boolean", "boolean"],
  ["byte", "number"],
  ["int8_t", "number"],
  ["int16_t", "number"],
  ["int32_t", "number"],
  ["int64_t", "bigint"],
  ["float", "number"],
  ["double", "number"],
  ["string", "string"],
]);
const kArrays = new Map([
  ["byte", "Uint8Array"],
  ["double", "Float64Array"],
  ["float", "Float32Array"],
  ["int32_t", "Int32Array"],
]);

function parse(text) {
  const types = [];
  const plain = text.replace(/\/\*[\s\S]*?\*\//g, "").replace(/\/\/.*$/gm, "");
  for (const [, name, body] of plain.matchAll(/struct\s+(\w+)\s*\{([^}]*)\}/g)) {
    const fields = [],
      constants = [];
    for (const statement of body
      .split(";")
      .map((part) => part.trim())
      .filter(Boolean)) {
      const constant = statement.match(/^const\s+(\w+)\s+(.*)$/s);
      if (constant) {
        for (const item of constant[2].split(","))
          constants.push(item.split("=").map((part) => part.trim()));
        continue;
      }
      const field = statement.match(/^(\w+)\s+(\w+)((?:\s*\[\s*\w+\s*\])*)$/);
      if (!field) throw new Error(`${name}: '${statement}' is not understood`);
      const sizes = [...field[3].matchAll(/\[\s*(\w+)\s*\]/g)].map(([, size]) =>
        /^\d+$/.test(size) ? Number(size) : size,
      );
      fields.push({ name: field[2], type: field[1], sizes });
    }
    types.push({ name, fields, constants });
  }
  return types;
}

function typescript(field) {
  const type = kPrimitives.get(field.type) ?? field.type;
  if (field.sizes.length === 0) return type;
  return kArrays.get(field.type) ?? `${type}[]`; // of several dimensions row by row
}

const types = readdirSync(folder)
  .filter((name) => name.endsWith(".lcm"))
  .sort()
  .flatMap((name) => parse(readFileSync(join(folder, name), "utf8")));
const lines = ["// Made from proto/*.lcm by generate.mjs.", ""];
for (const type of types) {
  lines.push(`export interface ${type.name} {`);
  for (const field of type.fields) lines.push(`  ${field.name}: ${typescript(field)};`);
  lines.push("}");
  if (type.constants.length > 0) {
    lines.push(
      `export const ${type.name} = { ${type.constants.map(([name, value]) => `${name}: ${value}`).join(", ")} } as const;`,
    );
  }
  lines.push("");
}
lines.push(
  "export interface Messages {",
  ...types.map((type) => `  ${type.name}: ${type.name};`),
  "}",
  "",
);
lines.push("export interface Field { name: string; type: string; sizes: (number | string)[] }");
lines.push("export const kTypes: Record<string, Field[]> = {");
for (const type of types) {
  const fields = type.fields.map(({ name, type: of, sizes }) =>
    JSON.stringify({ name, type: of, sizes }),
  );
  lines.push(`  ${type.name}: [${fields.join(", ")}],`);
}
lines.push("};", "");
writeFileSync(output, lines.join("\n"));
