// Frames a second of robots that all move, as a share of those of an empty scene in the same
// browser at the same pixels: in turns, so that what else the machine does falls on both. Given:
// {"robots": how many there must be, "turns": of each, "seconds": of a turn}.
export default async function share({ page, given, until }) {
  await page.setViewportSize({ width: 1366, height: 768 });
  await until(
    "robots are listed",
    (n) => window.ruedo?.page.now.world?.robots.length >= n,
    given.robots,
  );
  await until(
    "the world is drawn",
    () => window.ruedo.stage.bodies.description && window.ruedo.stage.frames > 2,
  );
  await page.keyboard.press("p"); // the view has the whole window
  const measured = await page.evaluate(async ({ robots, turns, seconds }) => {
    const { stage, poses, link } = window.ruedo,
      add = poses.add.bind(poses),
      frame = stage.frame.bind(stage),
      wait = (s) => new Promise((done) => setTimeout(done, 1000 * s));
    let isEmpty = false;
    // The robots of the log stand still. Here each drives a circle of 0.2 m at 0.4 m/s.
    poses.add = (state, at) => {
      const angle = Number(state.utime) / 500_000;
      for (let i = 0; i < state.index.length; ++i) {
        state.position[3 * i] += 0.2 * Math.cos(angle);
        state.position[3 * i + 1] += 0.2 * Math.sin(angle);
      }
      add(state, at);
    };
    stage.frame = (at, overlays) => {
      stage.touch(); // an empty scene is drawn as often as can be, too
      frame(at, overlays);
    };
    // Loops over the beginning of the log; an empty scene gets no states.
    const play = () => {
      if (isEmpty) return;
      link.seek(0);
      link.play(true, 1);
    };
    setInterval(play, 3000);
    const turn = async (empty) => {
      isEmpty = empty;
      stage.bodies.built.moving.visible = !empty;
      if (empty) link.play(false, 1);
      else play();
      await wait(0.5);
      const from = stage.frames,
        begun = performance.now();
      await wait(seconds);
      return (1000 * (stage.frames - from)) / (performance.now() - begun);
    };
    stage.home();
    play();
    await wait(8); // until its level of detail has settled
    const level = stage.quality.now,
      rates = { robots: [], empty: [] };
    Object.defineProperty(stage.quality, "now", { get: () => level });
    for (let i = 0; i < turns; ++i) {
      rates.robots.push(await turn(false));
      rates.empty.push(await turn(true));
    }
    const median = (values) => values.sort((a, b) => a - b)[values.length >> 1],
      [full, empty] = [median(rates.robots), median(rates.empty)],
      round = (value) => Math.round(100 * value) / 100;
    return {
      robots,
      ratio: level.ratio,
      plain: level.plain,
      frames_per_s: round(full),
      empty_per_s: round(empty),
      share: round(full / empty),
    };
  }, given);
  console.log(`measured: ${JSON.stringify(measured)}`);
}
