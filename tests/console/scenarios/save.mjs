// A file that another program has changed is not lost without a question.
export default async function save({ page, seen, told, until, check }) {
  await page.setViewportSize({ width: 1100, height: 640 });
  await until("(the world is drawn)", () => window.ruedo?.page.now.scene?.models.length > 0);
  await page.locator('[data-model="box_1"]').click();
  await page.locator("#delete").click();
  await until("(it is gone)", () => window.ruedo.editor.find("box_1") === undefined);
  seen("change the file");
  await told();
  const asked = async (answer) => {
    await page.locator("#save").click();
    const dialog = page.locator("dialog[open]");
    check("it asks for a confirmation", /another program/.test(await dialog.innerText()));
    await dialog.getByRole("button", { name: answer }).click();
  };
  const noted = (what, words) =>
    until(what, (text) => window.notes.some((note) => new RegExp(text).test(note)), words);
  await asked("Cancel");
  check("(it is still to be saved)", /•/.test(await page.locator("#save").innerText()));
  await asked("Save a copy");
  await noted("a copy is saved", "Saved a copy as w_2.sdf");
  await asked("Overwrite");
  await noted("or the file is overwritten", "Saved to w.sdf");
}
