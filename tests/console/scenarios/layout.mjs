// The open panels are stored for each world separately. The caller serves another world on the same
// address when told to.
export default async function layout({ page, seen, told, until, expect, ready, picture }) {
  expect(/WebSocket|net::ERR_|Failed to load|socket/); // its end cuts off what is under way
  const world = () => page.evaluate(() => window.ruedo.page.now.world.robots[0].name);
  const open = () => {
    const { tab, layers } = window.ruedo.page.now;
    return [tab, layers.has("sonar"), document.querySelectorAll(".pane").length].join(" ");
  };
  const isOpen = (what, words) =>
    until(
      what,
      ([of, words]) => {
        const { world, tab, layers } = window.ruedo.page.now,
          panes = document.querySelectorAll(".pane").length;
        return (
          world?.robots[0]?.name === of && [tab, layers.has("sonar"), panes].join(" ") === words
        );
      },
      words,
    );
  const change = async () => {
    const before = await world();
    seen("another world");
    await told();
    await until(
      "(it is there)",
      (name) => (window.ruedo.page.now.world?.robots[0]?.name ?? name) !== name,
      before,
    );
    return before;
  };
  await ready();
  await page.getByRole("tab", { name: "Plots" }).click();
  await page.evaluate(() => window.ruedo.plots.plot("p3at/odometry", "x", false));
  await page.locator('[data-layer="sonar"]').click();
  const notes = async (state) => {
    await page.locator("#open-panels").click();
    await page.locator("#panels").getByText("Notes", { exact: true }).click();
    await page.keyboard.press("Escape");
    await page.getByRole("tab", { name: "Notes" }).waitFor({ state });
  };
  await notes("detached");
  const first = await page.evaluate(open);
  const one = await change();
  const two = await world();
  await isOpen("plots are of their world", [two, "Plots false 0"]);
  await notes("attached"); // a new world begins with the last arrangement
  await page.getByRole("tab", { name: "World" }).click();
  await page.locator('[data-layer="sonar"]').click();
  await page.reload();
  await ready();
  await isOpen("what was open is open again", [two, "World true 0"]);
  await page.getByRole("tab", { name: "Notes" }).waitFor();
  await change();
  await isOpen("and in the other world what was open there", [one, first]);
  await page.getByRole("tab", { name: "Notes" }).waitFor({ state: "detached" });
  seen("arranged as it was there");
  await picture("layout");
}
