// ruedo render: one picture of a world at its start, from anywhere or as one of its cameras sees
// it.
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/progress.h"
#include "cli/logs/logged_run.h"
#include "cli/support/commands.h"
#include "cli/support/find_all.h"
#include "cli/support/range.h"
#include "report/render_devices.h"
#include "report/render_log.h"
#include "report/render_view.h"
#include "ruedo/errors.h"
#include "ruedo/image_t.hpp"
#include "scene/pictures/overview.h"
#include "system/output_file.h"
#include "world/mesh/codecs.h"
#include "world/settings.h"

namespace ruedo::cli {
namespace {

struct RenderArguments {
  WorldArguments world;
  std::string output, camera, view = "iso", size;
  std::string cut = "auto";
  bool rays = false;
  report::VideoArguments video;    // of a log; its name is "" for a picture
  std::vector<std::string> given;  // names of the options that were
};

// Drawn at twice the size with smooth edges, then reduced, where memory allows.
constexpr int kMaxSupersampledSide = 4096;

cv::Mat picture_of_world(const RenderArguments& arguments, const world::WorldModel& world,
                         const world::BodyLayout& layout) {
  const auto renderer = scene::make_renderer(world, layout);
  const report::Size size =
      arguments.size.empty() ? report::Size{} : report::parse_size(arguments.size);
  Vec3 sunlight(1, 1, -1);
  for (const world::Light& light : world.lights) {
    if (light.type != world::Light::Type::directional) continue;
    sunlight = light.pose.rotation * light.direction;
    break;
  }
  scene::View view =
      report::parse_view(arguments.view, size, scene::overview(world).shown, sunlight);
  const int factor = std::max(view.width, view.height) <= kMaxSupersampledSide ? 2 : 1;
  const cv::Size wanted(view.width, view.height);
  view.width *= factor;
  view.height *= factor;
  view.fx *= factor;
  view.fy *= factor;
  view.cx *= factor;
  view.cy *= factor;
  view.samples = 4;
  scene::Picture picture;
  const std::vector<scene::Line> lines =
      arguments.rays ? report::device_rays(world, layout) : std::vector<scene::Line>();
  renderer->draw(report::initial_snapshot(layout), view, picture, {.lines = lines});
  cv::Mat rgb(view.height, view.width, CV_8UC3, picture.rgb.data()), reduced, bgr;
  cv::resize(rgb, reduced, wanted, 0, 0, cv::INTER_AREA);
  cv::cvtColor(reduced, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

void require_camera(const std::string& camera, const world::WorldModel& world) {
  const world::BodyLayout layout(world);
  std::vector<std::string> cameras;
  for (const std::string& name : report::device_names(world, layout)) {
    const auto device = report::make_lone_device(world, layout, name, false);
    if (device && device->kind->needs_renderer) cameras.push_back(name);
  }
  if (std::find(cameras.begin(), cameras.end(), camera) != cameras.end()) return;
  const std::string near = nearest_word(camera, cameras);
  throw InputError(
      {}, fmt::format("--camera {}: there is no such camera; {}", camera,
                      cameras.empty() ? "the world has none"
                                      : fmt::format("there are: {}", fmt::join(cameras, ", "))) +
              (near.empty() ? "" : "; did you mean " + near + "?"));
}

// The camera's own picture: with its lens, noise and exposure, but not compressed.
cv::Mat picture_of_camera(const RenderArguments& arguments, const world::WorldModel& world,
                          const world::BodyLayout& layout) {
  const auto device =
      report::make_lone_device(world, layout, arguments.camera, !arguments.world.no_noise);
  const auto renderer = scene::make_renderer(world, layout);
  Outbox out;
  device->sensor->sample({report::initial_snapshot(layout), 0, nullptr, renderer.get()}, out);
  for (const Outbox::Entry& entry : out.entries()) {
    if (device->channels[entry.channel] != arguments.camera) continue;
    image_t image;
    if (image.decode(out.data(entry), 0, static_cast<int>(entry.size)) < 0) break;
    if (image.pixelformat == image_t::PIXEL_FORMAT_MJPEG)
      return world::decode_picture(image.data.data(), image.data.size(), cv::IMREAD_COLOR);
    const bool grey = image.pixelformat == image_t::PIXEL_FORMAT_GRAY;
    cv::Mat bgr, pixels(image.height, image.width, grey ? CV_8UC1 : CV_8UC3, image.data.data(),
                        static_cast<size_t>(image.row_stride));
    if (grey) return pixels.clone();
    cv::cvtColor(pixels, bgr, cv::COLOR_RGB2BGR);
    return bgr;
  }
  throw EnvironmentError("the camera gave no picture");
}

// Colour pictures of the requested camera come raw, in the requested size.
std::shared_ptr<const world::WorldModel> load(const RenderArguments& arguments) {
  draw_as_told(arguments.world);
  world::LoadOptions options = load_options(arguments.world);
  if (arguments.camera.empty()) return world::load_world(arguments.world.world, options);
  const size_t slash = arguments.camera.find('/');
  if (slash == std::string::npos)
    throw InputError({}, "--camera " + arguments.camera + ": allowed is ROBOT/DEVICE");
  const std::string robot = arguments.camera.substr(0, slash),
                    device = arguments.camera.substr(slash + 1);
  const report::Size size =
      arguments.size.empty() ? report::Size{} : report::parse_size(arguments.size);
  std::vector<world::Setting> settings{{robot, device, "ruedo:encoding", "rgb"}};
  settings.insert(settings.end(), options.settings.begin(),
                  options.settings.end());  // the user's settings come later and win
  if (size.width != 0) {
    settings.push_back({robot, device, "camera.image.width", std::to_string(size.width)});
    settings.push_back({robot, device, "camera.image.height", std::to_string(size.height)});
  }
  options.settings.clear();
  const auto world =
      std::make_shared<world::WorldModel>(*world::load_world(arguments.world.world, options));
  require_camera(arguments.camera, *world);
  world::apply_settings(settings, *world);
  return world;
}

// nullopt: without a cut.
std::optional<double> height_to_cut_at(const RenderArguments& arguments,
                                       const world::WorldModel& world) {
  const bool from_outside = arguments.view == "top" || arguments.view == "iso";
  if (arguments.cut == "none") return std::nullopt;
  if (arguments.cut == "auto")
    return arguments.camera.empty() && from_outside ? scene::overview(world).ceiling : std::nullopt;
  const std::optional<double> height = report::parse_number(arguments.cut);
  if (!height)
    throw InputError({}, "--cut " + arguments.cut + ": allowed are a height in m, auto and none");
  return height;
}

int video(const RenderArguments& arguments) {
  // A log has the world and its options; the others would do nothing.
  static const std::vector<std::string> kTaken{"--video", "--follow", "--fps",  "--rate",
                                               "--from",  "--to",     "--view", "--size",
                                               "WORLD",   "--plugin", "--quiet"};
  for (const std::string& name : arguments.given) {
    if (std::find(kTaken.begin(), kTaken.end(), name) == kTaken.end())
      throw InputError({}, "--video goes with --view, not with " + name);
  }
  report::VideoArguments video = arguments.video;
  video.log = arguments.world.world;
  video.view = arguments.view;
  video.size = arguments.size;
  report::render_video(video,
                       [&](const log_header_t& header) { return load_run(header, video.log); });
  return kGood;
}

int render(const RenderArguments& arguments) {
  if (!arguments.video.video.empty()) return video(arguments);
  for (const std::string& name : arguments.given) {
    if (name == "--follow" || name == "--fps" || name == "--rate" || name == "--from" ||
        name == "--to")
      throw InputError({}, name + " goes with --video");
  }
  if (arguments.output.empty())
    throw InputError({}, "render: --output FILE or --video FILE is required");
  if (!arguments.camera.empty() && arguments.rays) {
    throw InputError({},
                     "--rays goes with --view, not with --camera: a camera does not see the rays");
  }
  std::string extension = std::filesystem::path(arguments.output).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") {
    throw InputError(
        {}, "-o " + arguments.output + ": allowed are names that end in .png, .jpg or .jpeg");
  }
  auto world = load(arguments);
  check_options(arguments.world, *world);
  print_findings(world->findings);
  if (const auto height = height_to_cut_at(arguments, *world)) {
    world = scene::without_what_is_above(*world, *height);
    if (arguments.cut == "auto")
      fmt::print(
          "what is above {:.3g} m is left out, since it hides the rest; --cut none shows it\n",
          *height);
  }
  const world::BodyLayout layout(*world);
  const Progress progress("drawing " + world->name);
  const cv::Mat bgr = arguments.camera.empty() ? picture_of_world(arguments, *world, layout)
                                               : picture_of_camera(arguments, *world, layout);
  std::vector<uint8_t> bytes;
  world::encode_picture(extension, bgr, bytes);
  write_file(arguments.output, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  fmt::print("{}: {} x {} pixels\n", arguments.output, bgr.cols, bgr.rows);
  return kGood;
}

void add_video_arguments(CLI::App& command, report::VideoArguments& arguments) {
  command
      .add_option("--video", arguments.video,
                  "WORLD is a log: make it a video, .webm (VP8) or .mp4 (H.264)")
      ->type_name("FILE");
  command.add_option("--follow", arguments.follow, "the camera follows this robot")
      ->type_name("ROBOT");
  command.add_option("--fps", arguments.fps, "frame rate of the video (1/s)")
      ->type_name("N")
      ->capture_default_str()
      ->check(within(1.0, 120.0));
  command.add_option("--rate", arguments.rate, "log time per second of the video")
      ->type_name("S")
      ->capture_default_str()
      ->check(within(0.001, 1000.0));
  command
      .add_option("--from", arguments.from_s, "start of the video (s after the log's beginning)")
      ->type_name("T");
  command.add_option("--to", arguments.to_s, "and where it ends, s")->type_name("T");
}

void add_render(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("render", "draw a picture of a world at its start, or a video of a log");
  const auto arguments = std::make_shared<RenderArguments>();
  add_world_arguments(*command, arguments->world);
  command->add_option("-o,--output", arguments->output, "the picture: .png or .jpg")
      ->type_name("FILE");
  auto* camera = command->add_option("--camera", arguments->camera, "as this camera sees it")
                     ->type_name("ROBOT/DEVICE");
  command
      ->add_option("--view", arguments->view,
                   "top, iso, or x,y,z,roll,pitch,yaw (m, rad; x looks ahead, 1.2 rad wide)")
      ->type_name("VIEW")
      ->capture_default_str()
      ->excludes(camera);
  command
      ->add_option(
          "--cut", arguments->cut,
          "leave out everything above this height (m); auto: only a roof that hides the world")
      ->type_name("HEIGHT")
      ->capture_default_str()
      ->excludes(camera);
  command->add_option("--size", arguments->size, "size of the picture in pixels")->type_name("WxH");
  command->add_flag("--rays", arguments->rays,
                    "draw the rays of laser scanners and the cones of sonars");
  add_video_arguments(*command, arguments->video);
  command->callback([arguments, command, &chosen] {
    for (const CLI::Option* option : command->get_options()) {
      if (option->count() > 0) arguments->given.push_back(option->get_name());
    }
    chosen = [arguments] { return render(*arguments); };
  });
}

const RegisterCommand kRegister{40, add_render};

}  // namespace
}  // namespace ruedo::cli
