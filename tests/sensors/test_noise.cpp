// SDF's <noise> against its own model: mean, sigma, bias, the wandering bias, quantisation.
#include "sensors/noise.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo {
namespace {

Element noise_element(const std::string& type,
                      const std::vector<std::pair<std::string, std::string>>& parameters) {
  Element noise;
  noise.name = "noise";
  noise.source = {"n.sdf", 1};
  if (!type.empty()) noise.attributes = {{"type", type}};
  int line = 1;
  for (const auto& [name, text] : parameters) {
    auto child = std::make_unique<Element>();
    child->name = name;
    child->text = text;
    child->source = {"n.sdf", ++line};
    noise.children.push_back(std::move(child));
  }
  return noise;
}

TEST(Noise, WithoutAnyTheIdealValueComesBackBitByBit) {
  const Element off = noise_element("none", {{"stddev", "1"}});
  const Element empty = noise_element("gaussian", {});
  for (Noise noise : {Noise(), Noise(nullptr), Noise(&off), Noise(&empty)}) {
    EXPECT_TRUE(noise.none());
    RandomStream stream(1, 1), untouched(1, 1);
    EXPECT_EQ(noise.apply(0.1, 0.01, stream), 0.1);
    EXPECT_EQ(noise.apply(-0.0, 0.01, stream), -0.0);
    EXPECT_EQ(stream.bits(), untouched.bits());  // nothing was drawn
  }
}

TEST(Noise, OneValueByHand) {
  const Element element =
      noise_element("gaussian", {{"mean", "0.5"}, {"stddev", "2"}, {"bias_mean", "0.25"}});
  Noise noise(&element);
  RandomStream stream(3, 4), same(3, 4);
  EXPECT_EQ(noise.apply(10.0, 0.0, stream), 10.0 + 0.5 + 2.0 * same.gaussian() + 0.25);
}

TEST(Noise, TypeMayBeAChildAsInOldFiles) {
  const Element element = noise_element("", {{"type", "gaussian"}, {"stddev", "0.1"}});
  EXPECT_EQ(Noise(&element).stddev(), 0.1);
  const Element without = noise_element("", {{"stddev", "0.1"}});
  EXPECT_TRUE(Noise(&without).none());
}

// 20 000 values: mean and sigma within the 99.9 % interval.
TEST(Noise, MeanAndSigma) {
  const Element element = noise_element("gaussian", {{"mean", "0.3"}, {"stddev", "0.05"}});
  Noise noise(&element);
  constexpr int kSamples = 20000;
  double sum = 0, squares = 0;
  for (uint64_t k = 0; k < kSamples; ++k) {
    RandomStream stream(77, k);
    const double error = noise.apply(2.0, 0.01, stream) - 2.3;
    sum += error;
    squares += error * error;
  }
  EXPECT_LT(std::abs(sum / kSamples), 3.29 * 0.05 / std::sqrt(kSamples));
  EXPECT_NEAR(squares / kSamples / (0.05 * 0.05), 1.0, 3.29 * std::sqrt(2.0 / kSamples));
}

// The bias stays for a run, and over many devices it is normal.
TEST(Noise, BiasIsDrawnOnce) {
  const Element element = noise_element("gaussian", {{"bias_mean", "1"}, {"bias_stddev", "0.2"}});
  constexpr int kDevices = 5000;
  double sum = 0, squares = 0;
  for (uint64_t key = 0; key < kDevices; ++key) {
    Noise noise(&element);
    RandomStream constants(key * 0x9e3779b97f4a7c15u, kConstantDraws);
    noise.draw_bias(constants);
    RandomStream stream(key, 0);
    const double bias = noise.apply(0.0, 0.0, stream);
    EXPECT_EQ(noise.apply(0.0, 0.01, stream), bias);
    sum += bias - 1.0;
    squares += (bias - 1.0) * (bias - 1.0);
  }
  EXPECT_LT(std::abs(sum / kDevices), 3.29 * 0.2 / std::sqrt(kDevices));
  EXPECT_NEAR(squares / kDevices / 0.04, 1.0, 3.29 * std::sqrt(2.0 / kDevices));
}

// sigma 0.5, tau 0.8 s: the process has the variance sigma^2 tau/2 = 0.1 and the correlation
// exp(-dt/tau).
TEST(Noise, WanderingBiasIsAGaussMarkovProcess) {
  const Element element = noise_element(
      "gaussian", {{"dynamic_bias_stddev", "0.5"}, {"dynamic_bias_correlation_time", "0.8"}});
  constexpr int kDevices = 4000;
  constexpr double kDt = 0.2;
  double at_end = 0, squares = 0, neighbours = 0;
  for (uint64_t key = 0; key < kDevices; ++key) {
    Noise noise(&element);
    double last = 0, value = 0;
    for (uint64_t k = 0; k <= 40; ++k) {  // ten times tau
      RandomStream stream(key * 0x9e3779b97f4a7c15u, k);
      last = value;
      value = noise.apply(0.0, k == 0 ? 0.0 : kDt, stream);
      if (k == 0) {
        EXPECT_EQ(value, 0.0);
      }
    }
    at_end += value;
    squares += value * value;
    neighbours += value * last;
  }
  const double variance = 0.1;
  EXPECT_LT(std::abs(at_end / kDevices), 3.29 * std::sqrt(variance / kDevices));
  EXPECT_NEAR(squares / kDevices / variance, 1.0, 3.29 * std::sqrt(2.0 / kDevices));
  EXPECT_NEAR(neighbours / kDevices / variance, std::exp(-kDt / 0.8),
              3.29 * std::sqrt(2.0 / kDevices));
}

// Without a correlation time it is a random walk: the variance after T is sigma^2 T.
TEST(Noise, WithoutCorrelationTimeTheBiasWalks) {
  const Element element = noise_element("gaussian", {{"dynamic_bias_stddev", "0.1"}});
  constexpr int kDevices = 4000;
  double squares = 0;
  for (uint64_t key = 0; key < kDevices; ++key) {
    Noise noise(&element);
    double value = 0;
    for (uint64_t k = 0; k <= 20; ++k) {
      RandomStream stream(key * 0x9e3779b97f4a7c15u, k);
      value = noise.apply(0.0, k == 0 ? 0.0 : 0.25, stream);
    }
    squares += value * value;
  }
  EXPECT_NEAR(squares / kDevices / (0.01 * 5.0), 1.0, 3.29 * std::sqrt(2.0 / kDevices));
}

TEST(Noise, QuantisationRoundsToMultiples) {
  const Element element = noise_element("gaussian_quantized", {{"precision", "0.25"}});
  Noise noise(&element);
  RandomStream stream(1, 1);
  EXPECT_EQ(noise.apply(1.1, 0.01, stream), 1.0);
  EXPECT_EQ(noise.apply(-1.2, 0.01, stream), -1.25);
  const Element plain = noise_element("gaussian", {{"precision", "0.25"}});
  EXPECT_TRUE(Noise(&plain).none());  // SDF: for gaussian_quantized only
}

TEST(Noise, RefusedConfigurations) {
  struct Case {
    const char* type;
    const char* name;
    const char* text;
    const char* error;
  };
  for (const Case& c :
       {Case{"gauss", "mean", "0",
             "n.sdf:1: <noise>: type 'gauss' is not allowed; allowed: none, gaussian, "
             "gaussian_quantized"},
        {"gaussian", "stddev", "-1",
         "n.sdf:2: <noise/stddev>: '-1' is not allowed; allowed is a number of at least 0"},
        {"gaussian", "stddev", "nan", "n.sdf:2: <noise/stddev>: 'nan' is not finite"},
        {"gaussian", "mean", "1e999", "n.sdf:2: <noise/mean>: '1e999' is too large"},
        {"gaussian", "bias_mean", "x", "n.sdf:2: <noise/bias_mean>: 'x' is not a number"},
        {"gaussian", "bias_stddev", "inf", "n.sdf:2: <noise/bias_stddev>: 'inf' is not finite"},
        {"gaussian", "dynamic_bias_correlation_time", "-3",
         "n.sdf:2: <noise/dynamic_bias_correlation_time>: '-3'"},
        {"gaussian_quantized", "precision", "-0.1", "n.sdf:2: <noise/precision>: '-0.1'"}}) {
    const Element element = noise_element(c.type, {{c.name, c.text}});
    try {
      Noise noise(&element);
      ADD_FAILURE() << c.error;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::StartsWith(c.error));
    }
  }
}

}  // namespace
}  // namespace ruedo
