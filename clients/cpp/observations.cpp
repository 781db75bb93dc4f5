// What step() saw, decoded on demand.
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

template <>
RawSample decoded<RawSample>(const Observations::Message& message) {
  return raw_sample(WireReader(message.bytes.data(), message.bytes.size()));
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

#define RUEDO_OBSERVATIONS(SampleType, type)                                           \
  template std::vector<SampleType> Observations::all(const Stream<SampleType>&) const; \
  template std::optional<SampleType> Observations::latest(const Stream<SampleType>&) const;
RUEDO_SAMPLE_TYPES(RUEDO_OBSERVATIONS)
RUEDO_OBSERVATIONS(RawSample, )
#undef RUEDO_OBSERVATIONS

}  // namespace ruedo::client
