// Driving: the velocities that a robot gets.
import { expect, it } from "vitest";
import { Control } from "../src/control";

const robot = { name: "r", max_speed: 0.5, max_turn_rate: 1.2 };
const world = {
  robots: [robot],
  channels: [{ name: "r/velocity", robot: "r", input: true, type: "velocity_command_t" }],
};

// A page with that robot, and what its server got.
function page() {
  const told: string[] = [],
    now = { world, robot: 0, paused: false, hello: { mode: "run" } },
    link = { command: (channel: string) => told.push(channel) };
  type Given = ConstructorParameters<typeof Control>;
  const given = [{ now }, link, {}, {}] as unknown as Given;
  return { control: new Control(...given), told };
}

it("a robot gets its share of its speed and turn rate", () => {
  const { control, told } = page();
  expect(control.drive(1, 0)).toEqual({ robot: "r", vx: 0.5, omega: 0 });
  expect(control.drive(0.5, 1)).toEqual({ robot: "r", vx: 0.25, omega: 1.2 });
  expect(control.drive(0, -1)).toEqual({ robot: "r", vx: 0, omega: -1.2 });
  expect(told).toEqual(["r/velocity", "r/velocity", "r/velocity"]);
});

it("a robot that backs up steers as a car does: left moves its back to the left", () => {
  const { control } = page();
  expect(control.drive(-1, 0.5)).toEqual({ robot: "r", vx: -0.5, omega: -0.6 });
  expect(control.drive(-1, -0.5)).toEqual({ robot: "r", vx: -0.5, omega: 0.6 });
});
