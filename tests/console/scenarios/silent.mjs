// A server that is connected but does not answer, because its process is stopped. Prints when the
// caller is to stop it, and when to continue it.
export default async function silent({ page, seen, until, check, ready, told, picture }) {
  await page.setViewportSize({ width: 683, height: 384 }); // a laptop's window at 200 %
  await ready();
  const height = () =>
    page.evaluate(() => document.getElementById("view").getBoundingClientRect().height);
  check("a low window has room for the view", (await height()) > 200, `${await height()} px`);
  check(
    "and all of its bars",
    await page.evaluate(() =>
      [...document.querySelectorAll("#bar > *, #timeline button, #timeline select")]
        .filter((element) => element.checkVisibility())
        .every((element) => {
          const { left, right, top, bottom } = element.getBoundingClientRect();
          return left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight;
        }),
    ),
  );
  await picture("low");
  seen("stop");
  await told();
  await until("the page says that nobody answers", () =>
    /does not answer/.test(document.getElementById("notice")?.textContent),
  );
  await until(
    "and not that it runs",
    () => document.getElementById("state").textContent === "no answer",
  );
  await picture("silent");
  seen("go on");
  await told();
  await until("it runs again", () => document.getElementById("state").textContent === "running");
  await until("nothing is said any more", () => document.getElementById("notice").hidden);
  await until("but that it answers", () => window.notes.includes("The server answers again."));
}
