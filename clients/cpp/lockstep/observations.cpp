// The observations of step(), decoded on demand.
#include "core.h"
#include "samples/sample_types.h"

namespace ruedo::client {

template <class SampleType>
std::vector<SampleType> Observations::all(const Stream<SampleType>& stream) const {
  std::vector<SampleType> samples;
  for (const Message& message : messages) {
    if (message.channel == stream.channel())
      samples.push_back(decoded<SampleType>(message.channel, message.bytes));
  }
  return samples;
}

template <class SampleType>
std::optional<SampleType> Observations::latest(const Stream<SampleType>& stream) const {
  for (auto message = messages.rbegin(); message != messages.rend(); ++message) {
    if (message->channel == stream.channel())
      return decoded<SampleType>(message->channel, message->bytes);
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
