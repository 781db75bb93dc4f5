// Messages of types that this page was not built with: their fields are shown. Given: {"channel",
// "shows": the expected text}.
export const expected = /404/; // the log has no world

export default async function types({ page, given, until }) {
  await until(
    "the log is shown",
    () => window.ruedo?.page.now.playback && window.ruedo.stage.frames,
  );
  await page.getByRole("tab", { name: "Channels" }).click();
  await page.locator(`tr[data-channel="${given.channel}"]`).click();
  for (const text of given.shows)
    await until(
      `${text} is shown`,
      (wanted) =>
        (document.querySelector(".channels pre")?.textContent ?? "")
          .replace(/\s+/g, " ")
          .includes(wanted),
      text,
    );
}
