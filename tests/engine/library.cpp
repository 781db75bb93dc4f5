// Uses ruedo::engine as C++ programs do: checks its arrays, errors and resets, then prints its
// messages, which test_library.py compares with those of the Python module.
#include <cstdio>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <ruedo/engine.h>

static_assert(__cplusplus == 201703L, "the header is for C++17");

namespace {

int failures = 0;

void expect(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "not so: %s\n", what);
  ++failures;
}

template <class Error, class Call>
void expect_error(Call call, const std::string& part) {
  try {
    call();
  } catch (const Error& error) {
    if (std::string(error.what()).find(part) == std::string::npos) expect(false, error.what());
    return;
  } catch (const std::exception& error) {
    return expect(false, error.what());
  }
  expect(false, part.c_str());
}

void look(const std::string& world) {
  expect_error<ruedo::InputError>([] { ruedo::Engine("nowhere"); }, "nowhere");
  ruedo::EngineOptions options;
  options.worlds = 2;
  options.noise = false;
  options.disable = {"p3at/camera"};
  options.settings = {{"p3at/lrf.update_rat", 10}};
  expect_error<ruedo::InputError>([&] { ruedo::Engine(world, options); },
                                  "did you mean 'update_rate'?");
  options.settings = {};
  ruedo::Engine made(world, options);
  ruedo::Engine engine = std::move(made);
  expect(engine.worlds() == 2 && engine.step_size() == 0.005, "worlds and steps");
  expect(engine.robots() == std::vector<std::string>{"p3at"}, "robots");
  const ruedo::Observation position = engine.observe("pose.pos"),
                           ranges = engine.observe("lrf.ranges");
  expect(position.type() == ruedo::Observation::Type::float64 && position.size() == 3, "pose.pos");
  expect(position.shape() == std::vector<int64_t>{2, 1, 3}, "the shape of pose.pos");
  expect(ranges.type() == ruedo::Observation::Type::float32 && ranges.shape().back() == 181,
         "lrf.ranges");
  expect_error<std::invalid_argument>([&] { (void)ranges.begin<double>(); },
                                      "of type float, not double");
  expect_error<std::out_of_range>([&] { (void)ranges.begin<float>(2); }, "there are 2");
  expect_error<ruedo::InputError>([&] { (void)engine.observe("ranges"); }, "not a DEVICE.FIELD");
  expect_error<std::invalid_argument>([&] { engine.step(0); }, "1 or more");
  expect_error<std::invalid_argument>([&] { engine.step(1, {0.1, 0.0}); }, "take 6");
  expect_error<std::out_of_range>([&] { engine.reset(2, 1); }, "there are 2");
  const uint64_t first = engine.state_hash(0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  engine.step(200, {0.2, 0.0, 0.0, nan, nan, nan});  // copy 1 gets no command
  expect(engine.time(0) == 1.0 && engine.current_step(1) == 200, "a second");
  expect(position.begin<double>(0)[0] > 0.05, "copy 0 has moved");
  expect(position.begin<double>(1)[0] == 0.0, "copy 1 has not");
  const ruedo::SavedWorld saved = engine.save(0);
  expect(saved.world() == 0 && saved.step() == 200, "what was saved");
  engine.step(100);
  const uint64_t after = engine.state_hash(0);
  engine.restore(saved);
  engine.restore(saved, {1});
  expect(engine.current_step(1) == 200, "restored");
  engine.step(100);
  expect(engine.state_hash(0) == after && engine.state_hash(1) == after, "what followed follows");
  expect_error<std::out_of_range>([&] { (void)engine.save(2); }, "there are 2");
  expect_error<std::out_of_range>([&] { engine.restore(saved, {2}); }, "there are 2");
  expect_error<ruedo::InputError>([&] { engine.restore(ruedo::SavedWorld()); }, "never saved");
  ruedo::Engine other(world, options);
  expect_error<ruedo::InputError>([&] { other.restore(saved); }, "another engine");
  engine.reset();
  expect(engine.state_hash(0) == first && position.begin<double>(0)[0] == 0.0, "a fresh run");
}

}  // namespace

int main(int, char** arguments) try {
  const std::string world = arguments[1];
  look(world);
  ruedo::EngineOptions options;
  options.worlds = 2;
  options.seed = 7;
  options.disable = {"p3at/camera"};
  ruedo::Engine engine(world, options);
  engine.on_message([](const ruedo::EngineMessage& message) {
    std::printf("%d %lld %s ", message.world, static_cast<long long>(message.step),
                message.channel.c_str());
    for (size_t i = 0; i < message.size; ++i) std::printf("%02x", message.bytes[i]);
    std::printf("\n");
  });
  engine.step(60, {0.3, 0.0, 0.5, 0.1, 0.0, -0.2});
  engine.reset(1, 99);
  engine.step(40);
  return failures == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
