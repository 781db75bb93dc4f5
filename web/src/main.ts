// Starts the page.
import "./style.css";
import { App } from "./app/app";
import { chooseRobot } from "./state/choices";

declare global {
  interface Window {
    ruedo: object;
  } // the page's parts, for tests and the curious
}
try {
  const { model, scene, editing, panel, robot, arrivals, arranged } = new App(),
    choose = (at: number) => chooseRobot(model.page, at);
  window.ruedo = {
    ...model,
    ...scene,
    ...editing,
    ...panel,
    ...robot,
    ...arrivals,
    ...arranged,
    choose,
  };
} catch (error) {
  const notice = document.getElementById("notice")!;
  notice.hidden = false;
  notice.textContent = `This browser cannot show the console: ${(error as Error).message}`;
  throw error;
}
// A cookie keeps the token of the URL.
if (location.search && location.protocol !== "file:")
  history.replaceState(null, "", `/${location.hash}`);
