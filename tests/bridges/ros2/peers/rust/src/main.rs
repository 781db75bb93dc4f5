//! A peer of `ruedo run --ros2` in Rust: ros2-client over RustDDS, which share nothing with Ruedo.
//!
//! `ruedo-ros2-peer DOMAIN` prints a line for each thing that it tried: name, tab, type, tab, what
//! came of it.

use std::future::Future;
use std::time::{Duration, Instant};

use futures::StreamExt;
use ros2_client::{
    qos::{Durability, History},
    Context, ContextOptions, Message, MessageTypeName, Name, Node, NodeName, NodeOptions,
    QosProfile, ServiceMapping, ServiceTypeName,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use smol::future::FutureExt;

const PATIENCE: Duration = Duration::from_secs(60);

#[derive(Clone, Serialize, Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}
#[derive(Clone, Serialize, Deserialize)]
struct Header {
    stamp: Time,
    frame_id: String,
}
#[derive(Clone, Serialize, Deserialize)]
struct LaserScan {
    header: Header,
    angles: [f32; 3],
    times: [f32; 2],
    limits: [f32; 2],
    ranges: Vec<f32>,
    intensities: Vec<f32>,
}
#[derive(Clone, Default, Serialize, Deserialize)]
struct Vector3 {
    x: f64,
    y: f64,
    z: f64,
}
#[derive(Clone, Serialize, Deserialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}
#[derive(Clone, Default, Serialize, Deserialize)]
struct Twist {
    linear: Vector3,
    angular: Vector3,
}
#[derive(Clone, Serialize, Deserialize)]
struct TransformStamped {
    header: Header,
    child_frame_id: String,
    translation: Vector3,
    rotation: Quaternion,
}
#[derive(Clone, Serialize, Deserialize)]
struct TfMessage {
    transforms: Vec<TransformStamped>,
}
#[derive(Clone, Serialize, Deserialize)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Nothing {
    structure_needs_at_least_one_member: u8,
}
impl Message for Nothing {}
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Outcome {
    result: u8,
    error_message: String,
}
impl Message for Outcome {}
#[derive(Clone, Debug, Serialize, Deserialize)]
struct StateReply {
    state: u8,
    result: Outcome,
}
impl Message for StateReply {}
#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    state: u8,
}
impl Message for State {}
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Steps {
    steps: u64,
}
impl Message for Steps {}

fn report(name: &str, kind: &str, result: &str) {
    println!("{name}\t{kind}\t{result}");
}

async fn within<T>(patience: Duration, what: impl Future<Output = Option<T>>) -> Option<T> {
    what.or(async {
        smol::Timer::after(patience).await;
        None
    })
    .await
}

fn qos(latched: bool) -> QosProfile {
    let durability = if latched { Durability::TransientLocal } else { Durability::Volatile };
    QosProfile::publisher_default()
        .history(History::KeepLast { depth: 100 })
        .durability(durability)
}

async fn first<T: DeserializeOwned + 'static>(
    node: &mut Node,
    topic: &str,
    (package, kind): (&str, &str),
    latched: bool,
    is_right: impl Fn(&T) -> bool,
) {
    let name = Name::new("/", topic).unwrap();
    let topic_of = node.create_topic(&name, MessageTypeName::new(package, kind), &qos(latched));
    let reader = node.create_subscription::<T>(&topic_of.unwrap(), None).unwrap();
    let mut samples = Box::pin(reader.async_stream());
    let found = within(PATIENCE, async {
        while let Some(sample) = samples.next().await {
            match sample {
                Ok((message, _)) => return Some(is_right(&message)),
                Err(_) => continue,
            }
        }
        None
    })
    .await;
    let result = match found {
        Some(true) => "works",
        Some(false) => "fails: other values",
        None => "fails: nothing came",
    };
    report(&format!("/{topic}"), &format!("{package}/msg/{kind}"), result);
}

async fn drive(node: &mut Node) {
    let command = Name::new("/", "cmd_vel").unwrap();
    let kind = MessageTypeName::new("geometry_msgs", "Twist");
    let topic = node.create_topic(&command, kind, &qos(false)).unwrap();
    let commands = node.create_publisher::<Twist>(&topic, None).unwrap();
    let joints = Name::new("/", "joint_states").unwrap();
    let kind = MessageTypeName::new("sensor_msgs", "JointState");
    let topic = node.create_topic(&joints, kind, &qos(false)).unwrap();
    let states = node.create_subscription::<JointState>(&topic, None).unwrap();
    let deadline = Instant::now() + PATIENCE;
    let mut moves = false;
    while !moves && Instant::now() < deadline {
        let ahead = Twist { linear: Vector3 { x: 0.3, ..Default::default() }, ..Default::default() };
        let _ = commands.publish(ahead);
        smol::Timer::after(Duration::from_millis(50)).await;
        while let Ok(Some((state, _))) = states.take() {
            // 0.3 m/s on wheels of 0.111 m
            moves |= state.velocity.iter().any(|rate| (rate - 0.3 / 0.111).abs() < 0.01);
        }
    }
    let result = if moves { "works" } else { "fails: the wheels do not turn" };
    report("/cmd_vel", "geometry_msgs/msg/Twist", result);
}

async fn call<Q: Message + Clone + 'static, R: Message + 'static>(
    node: &mut Node,
    mapping: ServiceMapping,
    name: &str,
    kind: &str,
    request: Q,
    is_right: impl Fn(&R) -> bool,
) {
    let client = node
        .create_client::<Q, R>(
            mapping,
            &Name::new("/", name).unwrap(),
            &ServiceTypeName::new("simulation_interfaces", kind),
            qos(false),
            qos(false),
        )
        .unwrap();
    let found = within(PATIENCE, async {
        client.wait_for_service(node).await;
        // A request that is sent before the server knows of its writer goes to nobody.
        loop {
            let answer = within(Duration::from_secs(5), async {
                client.async_call_service(request.clone()).await.ok()
            });
            if let Some(reply) = answer.await {
                return Some(is_right(&reply));
            }
        }
    })
    .await;
    let result = match found {
        Some(true) => "works",
        Some(false) => "fails: another reply",
        None => "fails: no reply",
    };
    report(&format!("/{name}"), &format!("simulation_interfaces/srv/{kind}"), result);
}

async fn services(node: &mut Node, mapping: ServiceMapping) {
    let nothing = Nothing { structure_needs_at_least_one_member: 0 };
    let name = "get_simulation_state";
    call(node, mapping, name, "GetSimulationState", nothing, |reply: &StateReply| {
        reply.state <= 2 && reply.result.result == 1
    })
    .await;
    // The second who pauses hears that it is so already.
    let name = "set_simulation_state";
    call(node, mapping, name, "SetSimulationState", State { state: 2 }, |reply: &Outcome| {
        reply.result == 1 || reply.result == 101
    })
    .await;
    call(node, mapping, "step_simulation", "StepSimulation", Steps { steps: 20 }, |r: &Outcome| {
        r.result == 1
    })
    .await;
}

async fn list(context: &Context) {
    let deadline = Instant::now() + PATIENCE;
    let wanted = ["rt/scan", "rt/clock", "rt/tf", "rt/odom", "rt/cmd_vel"];
    let mut listed = false;
    let mut found: Vec<String> = Vec::new();
    while !listed && Instant::now() < deadline {
        found =
            context.discovered_topics().iter().map(|topic| topic.name.clone()).collect();
        listed = wanted.iter().all(|name| found.iter().any(|each| each == name));
        smol::Timer::after(Duration::from_millis(50)).await;
    }
    let result = format!("fails: of {} topics not all are listed", found.len());
    report("topics", "discovery", if listed { "works" } else { &result });
}

fn main() {
    let domain = std::env::args().nth(1).unwrap().parse().unwrap();
    let context = Context::with_options(ContextOptions::new().domain_id(domain)).unwrap();
    let options = NodeOptions::new().enable_rosout(false);
    let mut node = context.new_node(NodeName::new("/", "peer").unwrap(), options).unwrap();
    smol::spawn(node.spinner().unwrap().spin()).detach();
    smol::block_on(async {
        list(&context).await;
        let node = &mut node;
        first(node, "clock", ("rosgraph_msgs", "Clock"), false, |clock: &Time| {
            clock.nanosec % 10_000_000 == 0
        })
        .await;
        first(node, "scan", ("sensor_msgs", "LaserScan"), false, |scan: &LaserScan| {
            scan.header.frame_id == "lrf" && scan.ranges.len() == 181
        })
        .await;
        let frames = |frames: &TfMessage| !frames.transforms.is_empty();
        first(node, "tf", ("tf2_msgs", "TFMessage"), false, frames).await;
        first(node, "tf_static", ("tf2_msgs", "TFMessage"), true, frames).await;
        first(node, "robot_description", ("std_msgs", "String"), true, |urdf: &String| {
            urdf.contains("<robot name=\"p3at\">")
        })
        .await;
        drive(node).await;
        services(node, ServiceMapping::Enhanced).await;
    });
    std::process::exit(0);
}
