// Handlers by channel, and the receiving thread.
#include "transport/bus.h"

#include <algorithm>
#include <limits>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>

#include "bus/tcpq_wire.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::milliseconds kLendTime(20), kCatchUpTime(50);
constexpr std::chrono::microseconds kLookTime(100);

thread_local const void* received_from = nullptr;  // the bus's state that this thread receives for

}  // namespace

struct Bus::State : std::enable_shared_from_this<Bus::State> {
  using Handlers = CallbackList<const uint8_t*, size_t>;

  explicit State(std::unique_ptr<Transport> carrier) : transport(std::move(carrier)) {}

  void receive();
  void handle(std::chrono::milliseconds timeout);
  std::chrono::steady_clock::duration lent_for() const;
  bool handle_in_turn(const std::function<std::chrono::milliseconds()>& timeout);
  void leave(const std::string& channel);

  const std::unique_ptr<Transport> transport;
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<Handlers>, std::less<>> handlers;
  std::function<std::chrono::milliseconds()> turn;
  std::atomic<bool> closed{false};
  std::mutex receiving;
  std::atomic<std::chrono::steady_clock::rep> lent_until{0};
};

Bus::Bus(std::unique_ptr<Transport> transport)
    : state_(std::make_shared<State>(std::move(transport))) {}

Bus::~Bus() { close(); }

void Bus::start(std::function<std::chrono::milliseconds()> turn) {
  state_->turn = std::move(turn);
  thread_ = std::thread([state = state_] { state->receive(); });
}

Subscription Bus::subscribe(const std::string& channel, Handler handler) {
  const std::lock_guard lock(state_->mutex);
  auto& handlers = state_->handlers[channel];
  if (!handlers) {
    handlers = std::make_shared<State::Handlers>();
    state_->transport->subscribe(channel);
  }
  auto callback = handlers->add(channel, std::move(handler));
  callback->at_close([state = state_->weak_from_this(), list = std::weak_ptr(handlers), channel,
                      raw = callback.get()] {
    if (const auto here = list.lock()) here->remove(raw);
    if (const auto bus = state.lock()) bus->leave(channel);
  });
  return Subscription(std::move(callback));
}

void Bus::State::leave(const std::string& channel) {
  const std::lock_guard lock(mutex);
  const auto found = handlers.find(channel);
  if (found == handlers.end() || !found->second->empty()) return;
  handlers.erase(found);
  transport->unsubscribe(channel);
}

void Bus::check_size(const std::string& channel, size_t size) {
  if (size > bus::tcpq::kLargestMessage)
    throw Error("a message of " + std::to_string(size) + " bytes on " + channel +
                ": a server takes " + std::to_string(bus::tcpq::kLargestMessage) +
                " bytes at most");
}

void Bus::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  check_size(channel, size);
  if (!state_->closed) state_->transport->publish(channel, bytes, size);
}

bool Bus::is_connected() const { return state_->transport->is_connected(); }

void Bus::receive_eagerly() {
  const Turn turn(*this);
  state_->transport->receive_eagerly();
}

void Bus::stop() { state_->closed = true; }

void Bus::close() {
  stop();
  if (!thread_.joinable()) return;
  in_any_handler() ? thread_.detach() : thread_.join();
}

void Bus::catch_up() {
  if (handling()) return;
  const auto deadline = std::chrono::steady_clock::now() + kCatchUpTime;
  while (!state_->closed && state_->transport->has_news() &&
         std::chrono::steady_clock::now() < deadline) {
    // After a step() the receiving thread sleeps for a moment.
    if (!state_->handle_in_turn([] { return std::chrono::milliseconds(0); }))
      std::this_thread::sleep_for(kLookTime);
  }
}

bool Bus::handling() const { return received_from == state_.get(); }

bool Bus::in_any_handler() { return received_from != nullptr; }

void Bus::State::handle(std::chrono::milliseconds timeout) {
  transport->receive(timeout, [this](std::string_view channel, const uint8_t* bytes, size_t size) {
    std::shared_ptr<Handlers> called;
    {
      const std::lock_guard lock(mutex);
      if (const auto found = handlers.find(channel); found != handlers.end())
        called = found->second;
    }
    if (called && !closed) called->call(bytes, size);
  });
}

std::chrono::steady_clock::duration Bus::State::lent_for() const {
  return std::chrono::steady_clock::duration(lent_until) -
         std::chrono::steady_clock::now().time_since_epoch();
}

// Without waiting for the lock: a callback in another's turn may take for ever. False: another has
// it.
bool Bus::State::handle_in_turn(const std::function<std::chrono::milliseconds()>& timeout) {
  const std::unique_lock lock(receiving, std::try_to_lock);
  if (!lock) return false;
  const void* const before = std::exchange(received_from, this);
  handle(timeout());
  received_from = before;
  return true;
}

void Bus::State::receive() {
  while (!closed) {
    const auto lent = lent_for();
    if (lent.count() <= 0 && handle_in_turn(turn)) continue;
    std::this_thread::sleep_for(
        std::clamp<std::chrono::steady_clock::duration>(lent, kLookTime, kLendTime));
  }
}

Bus::Turn::Turn(Bus& bus)
    : state_(bus.state_), before_(std::exchange(received_from, state_.get())) {
  state_->lent_until = std::numeric_limits<std::chrono::steady_clock::rep>::max();
  state_->receiving.lock();
}

Bus::Turn::~Turn() {
  state_->lent_until = (std::chrono::steady_clock::now() + kLendTime).time_since_epoch().count();
  state_->receiving.unlock();
  received_from = before_;
}

void Bus::Turn::handle(std::chrono::steady_clock::duration timeout) {
  const auto rounded = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
  state_->handle(std::chrono::milliseconds(std::clamp<int64_t>(rounded, 0, 1000)));
}

}  // namespace ruedo::client
