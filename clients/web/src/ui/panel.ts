// The panel beside the view: pages for the robot, its plots, the channels, and the world.
import type { App } from "../app";
import type { ChannelList } from "./channels";
import type { RobotPages } from "./robot";
import { h, recall, remember } from "./dom";

type Page = "Robot" | "Plots" | "Channels" | "World";
const kPages: Page[] = ["Robot", "Plots", "Channels", "World"];
const kNeeds: Record<Page, string[]> = {
  Robot: ["pose_t", "odometry_t", "motion_status_t", "planar_lidar_t", "sonar_t", "image_t", "imu_t", "contact_t"],
  Plots: ["pose_t", "odometry_t"], Channels: [], World: [],
};
const kBox = `<?xml version="1.0"?><sdf version="1.9"><model name="box"><link name="link"><inertial><mass>5</mass>
<inertia><ixx>0.13</ixx><iyy>0.13</iyy><izz>0.13</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
<collision name="c"><geometry><box><size>0.4 0.4 0.4</size></box></geometry></collision>
<visual name="v"><geometry><box><size>0.4 0.4 0.4</size></box></geometry><material><diffuse>0.85 0.6 0.25 1</diffuse></material></visual></link></model></sdf>`;
const kThings: { name: string; model: string; text: string }[] = [
  { name: "a box", model: "", text: kBox }, { name: "Pioneer 3-AT", model: "p3at", text: "" }, { name: "Pioneer 3-DX", model: "p3dx", text: "" },
];

export class Panel {
  open: Page = (recall("page") as Page | null) ?? "Robot";
  private readonly tabs = new Map<Page, HTMLButtonElement>();
  private readonly page = h("div", { class: "page" });
  private readonly robots = h("select", { class: "full", id: "robots", "aria-label": "robot" });
  private readonly world: HTMLElement;
  private readonly thing = h("select", { class: "wide", "aria-label": "what to place" }, ...kThings.map(({ name }, i) => h("option", { value: i }, name)));
  private readonly place = h("button", { id: "place", click: () => (this.armed ? this.stopPlacing() : this.startPlacing()) }, "Place by click (B)");
  private armed = false;

  constructor(element: HTMLElement, private readonly app: App, private readonly robot: RobotPages, private readonly channels: ChannelList) {
    const tabs = h("div", { class: "tabs", role: "tablist" });
    for (const name of kPages) {
      const tab = h("button", { role: "tab", click: () => this.show(name) }, name);
      this.tabs.set(name, tab);
      tabs.append(tab);
    }
    this.robots.addEventListener("change", () => app.choose(this.robots.selectedIndex));
    const shadows = h("input", { type: "checkbox", checked: true });
    shadows.addEventListener("change", () => app.stage.setShadows(shadows.checked));
    const less = h("input", { type: "checkbox", checked: recall("detail") !== "full" });
    less.addEventListener("change", () => {
      remember("detail", less.checked ? "automatic" : "full");
      app.stage.setAutomatic(less.checked);
    });
    app.stage.setAutomatic(less.checked);
    this.world = h("section", {}, h("h2", {}, "Place"), h("div", { class: "row" }, this.thing, this.place),
      h("p", { class: "dim" }, "Then click on the ground."),
      h("h2", {}, "View"), h("label", { class: "check" }, shadows, "shadows"), h("label", { class: "check" }, less, "less detail where drawing is slow"),
      h("div", { class: "row" }, h("button", { click: () => app.stage.home() }, "Whole world (Home)")));
    element.append(tabs, this.page);
    this.show(kPages.includes(this.open) ? this.open : "Robot", true);
  }

  private show(name: Page, first = false): void {
    this.open = name;
    remember("page", name);
    for (const [page, tab] of this.tabs) tab.setAttribute("aria-selected", page === name ? "true" : "false");
    const content = { Robot: this.robot.statePage, Plots: this.robot.plotPage, Channels: this.channels.element, World: this.world }[name];
    const withRobot = name === "Robot" || name === "Plots";
    this.page.replaceChildren(...(withRobot ? [this.robots, h("div", { style: "height: 10px" })] : []), content);
    if (!first) this.app.want();
  }

  wants(type: string): boolean { return this.app.panelOpen() && kNeeds[this.open].includes(type); }

  showRobots(names: string[]): void {
    this.robots.replaceChildren(...names.map((name) => h("option", {}, name)));
    this.robots.hidden = names.length === 0;
  }
  chooseRobot(index: number): void { this.robots.selectedIndex = index; }

  placing(): { model: string; text: string } | null { return this.armed ? kThings[this.thing.selectedIndex]! : null; }
  startPlacing(): void { this.arm(true); }
  stopPlacing(): void { this.arm(false); }
  private arm(on: boolean): void {
    this.armed = on;
    this.place.classList.toggle("on", on);
    document.getElementById("canvas")!.classList.toggle("placing", on);
  }
}
