// What step() saw, decoded where somebody looks.
#include "core.h"
#include "sample_types.h"

namespace ruedo::client {
namespace {

template <class SampleType>
SampleType decoded(const Observations::Message& message) {
  const SampleDecoder& decoder = *find_decoder(message_type<SampleType>());
  try {
    WireReader in(message.bytes.data(), message.bytes.size());
    if (in.int64() == decoder.fingerprint)
      return static_cast<const SampleType&>(*decoder.decode(in));
  } catch (const WireError& error) {
    throw TypeMismatch(message.channel + ": a message is no valid " + decoder.type + ": " +
                       error.what());
  }
  throw TypeMismatch(message.channel + " carries another type than " + decoder.type +
                     ", or another version of it");
}

}  // namespace

template <class SampleType>
std::vector<SampleType> Observations::all(const Stream<SampleType>& stream) const {
  std::vector<SampleType> samples;
  for (const Message& message : messages) {
    if (message.channel == stream.channel()) samples.push_back(decoded<SampleType>(message));
  }
  return samples;
}

template <class SampleType>
std::optional<SampleType> Observations::latest(const Stream<SampleType>& stream) const {
  for (auto message = messages.rbegin(); message != messages.rend(); ++message) {
    if (message->channel == stream.channel()) return decoded<SampleType>(*message);
  }
  return std::nullopt;
}

#define RUEDO_OBSERVATIONS(SampleType)                                                 \
  template std::vector<SampleType> Observations::all(const Stream<SampleType>&) const; \
  template std::optional<SampleType> Observations::latest(const Stream<SampleType>&) const;
RUEDO_OBSERVATIONS(Scan)
RUEDO_OBSERVATIONS(LidarScan)
RUEDO_OBSERVATIONS(SonarReading)
RUEDO_OBSERVATIONS(Odometry)
RUEDO_OBSERVATIONS(Pose)
RUEDO_OBSERVATIONS(Image)
RUEDO_OBSERVATIONS(CameraInfo)
RUEDO_OBSERVATIONS(Imu)
RUEDO_OBSERVATIONS(Contact)
RUEDO_OBSERVATIONS(Joints)
RUEDO_OBSERVATIONS(MotionStatus)
#undef RUEDO_OBSERVATIONS

}  // namespace ruedo::client
