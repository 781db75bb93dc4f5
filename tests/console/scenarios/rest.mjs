// A run whose robot stands still and senses: nothing moves, so the view has full resolution, even
// without a GPU.
export default async function rest({ page, until, check, ready, seen }) {
  await page.setViewportSize({ width: 900, height: 520 });
  await ready();
  const scans = () =>
    page.evaluate(() => {
      window.scans ??= 0;
      const { overlays } = window.ruedo;
      for (const overlay of overlays.of.values()) {
        if (overlay.counted) continue;
        overlay.counted = true;
        const { scan } = overlay;
        overlay.scan = (...given) => (++window.scans, scan.apply(overlay, given));
      }
      return window.scans;
    });
  const before = await scans();
  const fine = () => {
    const canvas = document.getElementById("canvas");
    return canvas.width >= canvas.clientWidth && document.getElementById("reduced").hidden;
  };
  await until("a robot that stands is drawn with all pixels", fine);
  for (let i = 0; i < 5; ++i) {
    const [frames, now] = [await page.evaluate(() => window.ruedo.stage.frames), await scans()];
    await until("(scans come)", (n) => window.scans > n + 2, now);
    await until("(and are drawn)", (n) => window.ruedo.stage.frames > n, frames);
    check("(with all pixels)", await page.evaluate(fine));
  }
  seen(`with ${(await scans()) - before} scans meanwhile`);
  await page.locator("#canvas").focus();
  await page.keyboard.down("KeyA");
  await until("one that turns with fewer", () => !document.getElementById("reduced").hidden);
  await page.keyboard.up("KeyA");
  await until("and with all again when it stands", fine);
}
