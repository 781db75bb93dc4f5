// Unit tests of the page's parts that need no browser; run in the build's folder, where the
// packages and the message types are.
import { defineConfig } from "vitest/config";

export default defineConfig({
  resolve: { preserveSymlinks: true },
  test: { include: ["tests/**/*.test.ts"], cache: false, watch: false },
});
