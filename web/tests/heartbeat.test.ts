// Whether the server still answers.
import { expect, it } from "vitest";
import { Heartbeat } from "../src/wire/heartbeat";

// A server that answers or does not, how often it was asked, and what was reported.
function server() {
  const is = { there: true, asked: 0, told: [] as boolean[] };
  const heart = new Heartbeat(
    () => {
      ++is.asked;
      return is.there ? Promise.resolve() : Promise.reject(new Error("timeout"));
    },
    (silent) => is.told.push(silent),
  );
  return { is, heart };
}

it("a server that sends messages gets no ping", async () => {
  const { is, heart } = server();
  for (let at_ms = 0; at_ms < 60_000; at_ms += 1000) {
    heart.heard(at_ms);
    await heart.look(at_ms + 999);
  }
  expect([is.asked, is.told]).toEqual([0, []]);
});

it("an idle one gets a ping every three seconds, without a note", async () => {
  const { is, heart } = server();
  heart.restart(0);
  for (let at_ms = 0; at_ms <= 30_000; at_ms += 1000) await heart.look(at_ms);
  expect([is.asked, is.told]).toEqual([10, []]);
});

it("one that does not answer is reported once, and again when it answers", async () => {
  const { is, heart } = server();
  is.there = false;
  for (let at_ms = 0; at_ms <= 30_000; at_ms += 1000) await heart.look(at_ms);
  expect(is.told).toEqual([true]);
  heart.heard(31_000);
  heart.heard(31_001);
  expect(is.told).toEqual([true, false]);
});

it("any message counts as an answer; another connection restarts it", async () => {
  const { is, heart } = server();
  is.there = false;
  const looked = heart.look(10_000);
  heart.heard(10_500);
  await looked;
  expect(is.told).toEqual([]);
  await heart.look(20_000);
  heart.restart(21_000);
  heart.heard(21_001);
  expect(is.told).toEqual([true]);
});
