// Counter-based random numbers: a draw depends on (seed, robot, device, sample, draw) and on
// nothing else, so that no thread, no other device and no added robot can change it.
//
// The generator is Philox4x32-10 (Salmon et al., "Parallel Random Numbers: As Easy as 1, 2, 3", SC
// 2011).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace ruedo {

// The bijection itself: ten rounds of Philox4x32 on a counter under a key.
std::array<uint32_t, 4> philox4x32(std::array<uint32_t, 4> counter, std::array<uint32_t, 2> key);

// The x for which a normal variable of mean 0 and sigma 1 is below x with probability p, 0 < p < 1:
// Wichura's AS 241 (PPND16), relative error below 1e-15. Uses no function of libm but the square
// root, which is exact everywhere, so that its bits depend on no CPU.
double normal_quantile(double p);

// The draws of one sample. Cheap to make; holds 64 bytes and no reference.
class RandomStream {
 public:
  RandomStream(uint64_t key, uint64_t sample) : key_(key), sample_(sample) {}

  uint32_t bits();   // 32 random bits
  double uniform();  // in [0, 1), 53 bits
  // Normal with mean 0 and sigma 1, by the inverse of the normal distribution (Wichura's AS 241):
  // one uniform gives one value, with no state between draws.
  double gaussian();
  // The same values as a call of gaussian() for each; many at once cost less.
  void gaussians(std::span<double> values);

 private:
  uint64_t key_;
  uint64_t sample_;
  uint64_t block_ = 0;
  std::array<uint32_t, 4> output_{};
  int next_ = 4;
};

// The random source of one device of one robot. Copies are of the same device: what one is reseeded
// with holds for all, so that a sensor does nothing for it. One that is assigned draws as the other
// one does from then on, and so do all its copies; they stay apart from the other one's. Not thread
// safe.
class RandomSource {
 public:
  RandomSource(uint64_t seed, std::string_view robot, std::string_view device);
  RandomSource(const RandomSource&) = default;
  RandomSource& operator=(const RandomSource& other);
  ~RandomSource() = default;
  RandomStream stream(uint64_t sample) const { return {state_->key, sample}; }

  uint64_t seed() const { return state_->seed; }
  // From here on it draws what it would have drawn from that seed all along.
  void reseed(uint64_t seed);

 private:
  struct State {
    std::string robot, device;
    uint64_t seed, key;
  };
  std::shared_ptr<State> state_;
};

}  // namespace ruedo
