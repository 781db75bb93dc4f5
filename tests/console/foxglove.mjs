// A viewer by Foxglove's own client library: foxglove.mjs URL SECONDS TOPIC... Subscribes to those
// of the topics that are advertised, publishes a Twist on /cmd_vel four times a second, and prints
// a line of JSON for each message. SECONDS: of sim time, from the first that is heard of.
import { createRequire } from "node:module";

const require = createRequire(`${process.cwd()}/`); // the build's folder, where the packages are
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");

const [url, seconds, ...topics] = process.argv.slice(2);
const say = (line) => process.stdout.write(JSON.stringify(line) + "\n");
const socket = new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws: socket });
const topicOf = new Map();

client.on("error", (error) => say({ error: String(error.message ?? error) }));
client.on("close", () => process.exit(0));
client.on("serverInfo", (info) => {
  say({ info });
  const channel = client.advertise({
    topic: "/cmd_vel",
    encoding: "json",
    schemaName: "geometry_msgs/Twist",
  });
  const twist = { linear: { x: 0.2, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0.3 } };
  const bytes = new TextEncoder().encode(JSON.stringify(twist));
  setInterval(() => {
    client.sendMessage(channel, bytes);
    ++sent;
  }, 250);
});
client.on("advertise", (channels) => {
  for (const channel of channels) {
    say({ channel });
    if (topics.includes(channel.topic)) topicOf.set(client.subscribe(channel.id), channel.topic);
  }
});
client.on("status", (status) => say({ status }));
let first = null; // ns
let sent = 0;
client.on("time", ({ timestamp }) => {
  say({ time: String(timestamp) });
  first ??= timestamp;
  if (Number(timestamp - first) >= 1e9 * Number(seconds) && sent >= 3 * Number(seconds))
    client.close();
});
client.on("message", ({ subscriptionId, timestamp, data }) =>
  say({
    topic: topicOf.get(subscriptionId),
    at: String(timestamp),
    text: new TextDecoder().decode(data),
  }),
);
