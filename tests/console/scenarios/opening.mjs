// How long the page of a log takes to be drawn first, and then to seek to another moment, in
// seconds. Given:
// {"time": the other moment}.
export default async function opening({ page, given, ready }) {
  await ready();
  const drawn = await page.evaluate(() => window.ruedo.stage.firstDrawn_ms / 1000);
  const seek = await page.evaluate(async (time) => {
    const { link, page, stage } = window.ruedo,
      begin = performance.now(),
      { frames } = stage;
    link.play(false, 1);
    link.seek(time);
    const isThere = () => Math.abs(page.now.playback.now - time) < 0.1 && stage.frames > frames;
    while (!isThere()) await new Promise((next) => requestAnimationFrame(next));
    return (performance.now() - begin) / 1000;
  }, given.time);
  console.log(
    `measured: ${JSON.stringify({ drawn: Number(drawn.toFixed(3)), seek: Number(seek.toFixed(3)) })}`,
  );
}
