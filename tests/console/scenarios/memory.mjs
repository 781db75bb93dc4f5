// The memory of a page that stays open, once a minute after a garbage collection: the heap, buffers
// outside of it (kept messages), nodes, listeners, graphics objects. Given:
// {"minutes": how long}.
export default async function memory({ page, context, given, ready }) {
  await page.setViewportSize({ width: 480, height: 320 });
  await ready();
  const devtools = await context.newCDPSession(page);
  await devtools.send("Performance.enable");
  for (let minute = 0; minute <= given.minutes; ++minute) {
    if (minute > 0) await page.waitForTimeout(60_000);
    await devtools.send("HeapProfiler.collectGarbage");
    const { metrics } = await devtools.send("Performance.getMetrics");
    const of = (name) => metrics.find((each) => each.name === name).value;
    const { usedSize, embedderHeapUsedSize, backingStorageSize } =
      await devtools.send("Runtime.getHeapUsage");
    const graphics = await page.evaluate(() => {
      const { memory, programs } = window.ruedo.stage.renderer.info;
      return { ...memory, programs: programs.length };
    });
    const mb = (bytes) => Math.round(bytes / 1e4) / 100;
    console.log(
      `measured: ${JSON.stringify({
        minute,
        heap_mb: mb(usedSize),
        embedder_mb: mb(embedderHeapUsedSize ?? 0),
        buffers_mb: mb(backingStorageSize ?? 0),
        nodes: of("Nodes"),
        listeners: of("JSEventListeners"),
        ...graphics,
      })}`,
    );
  }
}
