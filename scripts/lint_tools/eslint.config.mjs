// Rules that find faults, by types where that finds more; how the code looks is prettier's affair.
// scripts/lint puts this beside the tools, in build/lint.
import js from "@eslint/js";
import globals from "globals";
import tseslint from "typescript-eslint";

export default tseslint.config(
  js.configs.recommended,
  {
    files: ["**/*.ts"],
    extends: tseslint.configs.recommendedTypeChecked,
    languageOptions: {
      parserOptions: {
        project: "../release/web/tsconfig.json",
        tsconfigRootDir: import.meta.dirname,
      },
    },
    rules: {
      // "!" stands where an index is in range by construction, though tsc does not ask for it.
      "@typescript-eslint/no-unnecessary-type-assertion": "off",
      // keyof Messages is all of them by name: the union is for tsc.
      "@typescript-eslint/no-redundant-type-constituents": "off",
    },
  },
  {
    files: ["**/*.mjs"],
    languageOptions: { globals: { ...globals.node, ...globals.browser } },
  },
);
