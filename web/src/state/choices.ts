// The user's choice of layers, by a button or a key.
import { remember } from "./memory";
import type { Page } from "./page";

export function chooseRobot(page: Page, robot: number): void {
  if (page.now.world?.robots[robot]) page.set({ robot });
}

export function chooseNextRobot(page: Page): void {
  const { world, robot } = page.now;
  chooseRobot(page, (robot + 1) % Math.max(1, world?.robots.length ?? 1));
}

export function toggleTheme(page: Page): void {
  const theme = page.now.theme === "dark" ? "light" : "dark";
  remember("theme", theme);
  page.set({ theme });
}

export function togglePanel(page: Page): void {
  page.set({ panel: !page.now.panel });
}

// Whether a click sends the chosen robot to that point.
export function toggleGoing(page: Page): void {
  page.set({ tool: page.now.tool === "go" ? "select" : "go" });
}
