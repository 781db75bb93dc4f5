// Accessibility: axe-core finds nothing, in both themes and on a phone; keys for tabs, camera and a
// robot among many; forced colours; no motion where the system asks for none; and without WebGL all
// but the view works.
import { readFileSync } from "node:fs";

export default async function access({ page, until, check, ready, fact, picture, expect }) {
  const axe = readFileSync("node_modules/axe-core/axe.min.js", "utf8");
  const faults = () =>
    page.evaluate(async () =>
      (await window.axe.run(document, { resultTypes: ["violations"] })).violations.map(
        ({ id, nodes }) =>
          `${id}: ${nodes
            .slice(0, 3)
            .map(({ html }) => html.slice(0, 80))
            .join(" ")}`,
      ),
    );
  const tab = (name) => page.getByRole("tab", { name }).click();
  await ready();
  const all = new Map();
  const note = async (where) => {
    for (const fault of await faults()) all.set(fault, where);
  };
  for (const [scheme, width, height] of [
    ["dark", 900, 520],
    ["light", 900, 520],
    ["dark", 390, 844],
  ]) {
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: scheme });
    await page.evaluate((theme) => {
      localStorage.clear();
      window.ruedo.page.set({ theme, panel: true });
    }, scheme);
    await page.evaluate(axe);
    for (const name of ["Robot", "Plots", "Channels", "World", "Notes"]) {
      await tab(name);
      await page.evaluate(() => {
        for (const part of document.querySelectorAll(".page details")) part.open = true;
      });
      await note(`${scheme}, ${width} wide, ${name}`);
    }
    await page.locator("#canvas").focus();
    await page.keyboard.press("?");
    await note(`${scheme}, keys`);
    await page.keyboard.press("Escape");
  }
  check(
    "a phone's bar is one row",
    await page.evaluate(() => document.getElementById("bar").getBoundingClientRect().height < 60),
  );
  check(
    "and names the world",
    await page.evaluate(() => {
      const { scrollWidth, clientWidth, textContent } = document.querySelector("#bar .name span");
      return textContent === "arena" && clientWidth > 0 && scrollWidth <= clientWidth;
    }),
  );
  await page.getByRole("button", { name: "more", exact: true }).click();
  check(
    "a phone has all of the bar",
    await page.evaluate(() =>
      [
        "rate",
        "orbit view (1)",
        "follow view (2)",
        "top view (3)",
        "dark or light (T)",
        "pause (space)",
        "one step while paused (.)",
        "panels and views",
      ].every((name) => {
        const box = [...document.querySelectorAll("#bar button, #bar select")]
          .find((e) => e.title === name || e.ariaLabel === name)
          ?.getBoundingClientRect();
        return box && box.width > 0 && box.left >= 0 && box.right <= innerWidth + 1;
      }),
    ),
    "some are not there",
  );
  await page.evaluate(axe);
  await note("phone, more of the bar");
  await picture("phone-more");
  await page.keyboard.press("Escape");
  check(
    "and what is opened there is closed by Esc",
    await page.evaluate(() => !document.getElementById("more").checkVisibility()),
  );
  check(
    "and its state is whole",
    await page.evaluate(() => {
      const { scrollWidth, clientWidth } = document.getElementById("state");
      return scrollWidth <= clientWidth;
    }),
  );
  check(
    "axe-core is content",
    all.size === 0,
    [...all].map((each) => each.join(" @ ")).join(" | "),
  );
  await tab("World");
  await picture("phone");
  await page.setViewportSize({ width: 900, height: 520 });

  // ---- keys
  await page.getByRole("tab", { name: "World" }).focus();
  await page.keyboard.press("ArrowLeft");
  const chosen = () =>
    page.evaluate(() => [window.ruedo.page.now.tab, document.activeElement.textContent].join());
  check("arrows go from tab to tab", (await chosen()) === "Channels,Channels×", await chosen());
  await page.keyboard.press("End");
  await page.keyboard.press("ArrowRight");
  check(
    "and around",
    (await chosen()) === "Robot,Robot×" &&
      (await page.evaluate(() => document.getElementById("readout").textContent === "")),
    await chosen(),
  );
  await page.locator("#canvas").focus();
  const camera = () =>
    page.evaluate(() => {
      const {
          camera: { position: p },
          controls: { target: t },
        } = window.ruedo.stage.view,
        d = [p.x - t.x, p.y - t.y, p.z - t.z];
      return {
        away: Math.hypot(...d),
        angle: Math.atan2(d[1], d[0]),
        height: d[2],
        at: [t.x, t.y],
      };
    });
  const after = async (key) => {
    const before = await camera();
    await page.keyboard.press(key);
    return [before, await camera()];
  };
  let [a, b] = await after("l");
  check(
    "L turns the view",
    Math.abs(
      Math.abs(Math.atan2(Math.sin(b.angle - a.angle), Math.cos(b.angle - a.angle))) - Math.PI / 24,
    ) < 0.01 && Math.abs(b.away - a.away) < 0.01,
    JSON.stringify([a, b]),
  );
  [a, b] = await after("i");
  check("I looks from higher", b.height > a.height + 0.01, JSON.stringify([a, b]));
  [a, b] = await after("+");
  check("+ comes nearer", Math.abs(a.away / b.away - 1.15) < 0.01, JSON.stringify([a, b]));
  [a, b] = await after("Shift+I");
  check(
    "Shift+I moves the view",
    Math.abs(Math.hypot(b.at[0] - a.at[0], b.at[1] - a.at[1]) - 0.06 * a.away) < 0.01 &&
      Math.abs(b.away - a.away) < 0.01,
    JSON.stringify([a, b]),
  );

  // ---- one among many robots
  await page.evaluate(() => {
    const {
      page: { now, set },
      page,
    } = window.ruedo;
    window.was = now.world;
    set.call(page, {
      world: {
        ...now.world,
        robots: Array.from({ length: 1000 }, (_, i) => ({ ...now.world.robots[0], name: `r${i}` })),
      },
      robot: 0,
    });
  });
  await page.locator(".find").fill("777");
  await page.keyboard.press("Enter");
  check(
    "a robot among many is found by its name",
    await page.evaluate(
      () =>
        window.ruedo.page.now.robot === 777 && document.querySelector(".robots").value === "r777",
    ),
  );
  await page.evaluate(() => window.ruedo.page.set({ world: window.was, robot: 0 }));

  // ---- full detail when nothing moves
  await page.locator("#canvas").focus();
  await page.keyboard.down("a");
  await until("while all moves it draws less, and says so", () => {
    const canvas = document.getElementById("canvas");
    return canvas.width < canvas.clientWidth && !document.getElementById("reduced").hidden;
  });
  await page.keyboard.up("a");
  await page.keyboard.press(" ");
  await until("paused, all pixels are drawn", () => {
    const canvas = document.getElementById("canvas");
    return (
      document.getElementById("state").textContent === "paused" &&
      canvas.width >= canvas.clientWidth &&
      document.getElementById("reduced").hidden
    );
  });
  await picture("still");
  await page.locator("#canvas").focus();
  await page.keyboard.press(" ");
  await page.keyboard.down("a");
  await until("(and less again)", () => !document.getElementById("reduced").hidden);
  await page.keyboard.up("a");

  // ---- colours and motion that the system asks for
  await page.emulateMedia({ forcedColors: "active", reducedMotion: "reduce" });
  // The page notices with its next frame.
  await until(
    "no motion for who wants none",
    () => !window.ruedo.stage.view.controls.enableDamping,
  );
  check(
    "what is chosen can be seen in forced colours",
    await page.evaluate(
      () =>
        getComputedStyle(document.querySelector('.dv-tab[aria-selected="true"]'))
          .borderBottomWidth === "2px" &&
        getComputedStyle(document.querySelector(".chip.on")).borderTopWidth === "2px",
    ),
  );
  await picture("forced");
  await page.emulateMedia({ forcedColors: "none", reducedMotion: "no-preference" });

  // ---- what is no longer drawn is freed
  const memory = () =>
    page.evaluate(() => {
      const { geometries, textures } = window.ruedo.stage.renderer.info.memory;
      return { geometries, textures };
    });
  await page.keyboard.press(" ");
  const reload = async () => {
    const frames = await page.evaluate(() => {
      window.ruedo.stage.home();
      return window.ruedo.stage.frames;
    });
    await page.evaluate(() => window.ruedo.loading.onScene());
    await until("(drawn again)", (n) => window.ruedo.stage.frames > n + 1, frames);
    return memory();
  };
  await reload();
  const first = await reload();
  for (let i = 0; i < 7; ++i) await reload();
  const last = await reload();
  // Pictures and shadows come a little later than their scene; a leak of one object for each of the
  // eight would add eight at least.
  check(
    "a new scene takes the place of the old one in the graphics memory",
    last.geometries < first.geometries + 8 && last.textures < first.textures + 8,
    JSON.stringify([first, last]),
  );
  await page.keyboard.press(" ");

  // ---- without WebGL
  expect(/WebGL/);
  await page.addInitScript(() => {
    const get = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function context(kind, ...more) {
      return /webgl/.test(kind) ? null : get.call(this, kind, ...more);
    };
  });
  await page.reload();
  await until("without WebGL it says so", () => document.getElementById("flat")?.checkVisibility());
  await tab("Robot");
  await until("(the robot's values are there)", () => document.querySelector('[data-fact="pose"]'));
  await page.locator("#canvas").focus();
  await page.keyboard.press(" ");
  await until("and can be paused", () => document.getElementById("state").textContent === "paused");
  await page.keyboard.press(" ");
  const x = await fact("pose");
  await page.keyboard.down("KeyW");
  await until(
    "and driven",
    (from) => parseFloat(document.querySelector('[data-fact="pose"]').textContent) > from + 0.1,
    x,
  );
  await page.keyboard.up("KeyW");
  await tab("Plots");
  await until("and plotted", () => document.querySelectorAll(".plot canvas").length === 3);
  await picture("flat");
}
