// The first view of a world. Given: {"corners": places that are in view, "eye": the place of the
// file's own camera, "red": places with something red}.
export default async function firstView({ page, given, until, check, picture }) {
  await page.setViewportSize({ width: 1000, height: 520 });
  await until(
    "(it is drawn)",
    () => window.ruedo?.stage.bodies.description && window.ruedo.stage.frames > 1,
  );
  await page.keyboard.press("p"); // the view has the whole window
  await until("(it has)", () => document.getElementById("view").clientWidth === innerWidth);
  await page.evaluate(() => window.ruedo.stage.setAutomatic(false)); // all pixels
  await picture("first-view");
  if (given.eye) {
    const eye = await page.evaluate(() => window.ruedo.stage.view.camera.position.toArray());
    check(
      "the view is the file's",
      eye.every((value, i) => Math.abs(value - given.eye[i]) < 1e-3),
      eye,
    );
  }
  if (given.corners) await seen({ page, check, corners: given.corners });
  if (given.red) {
    const colours = await page.evaluate(coloursAt, given.red);
    check(
      "all of it has its colour",
      colours.every(([r, g, b]) => r > 60 && r > 2 * g && r > 2 * b),
      JSON.stringify(colours.filter(([r, g]) => r <= 60 || r <= 2 * g)),
    );
  }
}

async function seen({ page, check, corners }) {
  const [widest, clear] = await page.evaluate((all) => {
    const { camera } = window.ruedo.stage.view,
      { fog } = window.ruedo.stage.scene,
      places = all.map((corner) => camera.position.clone().set(...corner));
    camera.updateMatrixWorld();
    const away = places.map((place) => place.distanceTo(camera.position));
    return [
      Math.max(
        ...places
          .map((place) => place.clone().project(camera))
          .flatMap(({ x, y }) => [Math.abs(x), Math.abs(y)]),
      ),
      fog.near > Math.max(...away),
    ];
  }, corners);
  check("all that counts is in view, and fills it", widest > 0.6 && widest < 1, widest);
  check("and no fog lies before it", clear);
}

// The colours of the picture at places of the world.
function coloursAt(places) {
  const { stage } = window.ruedo,
    { camera } = stage.view,
    source = document.getElementById("canvas"),
    copy = new OffscreenCanvas(source.width, source.height),
    pen = copy.getContext("2d");
  stage.redraw();
  pen.drawImage(source, 0, 0);
  return places.map((place) => {
    const { x, y } = camera.position
      .clone()
      .set(...place)
      .project(camera);
    const at = [((x + 1) / 2) * copy.width, ((1 - y) / 2) * copy.height].map(Math.floor);
    return [...pen.getImageData(...at, 1, 1).data].slice(0, 3);
  });
}
