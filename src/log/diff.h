// Compares two logs message by message and field by field, with a tolerance for each.
//
// Messages are matched by channel, timestamp and order. Messages of unknown types are compared by
// their bytes. The channel ruedo/header describes the machine and is not compared.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ruedo/schema.h"
#include "ruedo/sim_time.h"

namespace ruedo::log {

// An allowed difference. A value passes within any of the three tolerances; the last rule that
// matches a field applies.
struct DiffRule {
  std::string channel = "*";  // shell patterns
  std::string field = "*";    // without indices: "points.position"
  bool ignore = false;
  double absolute = 0.0;
  double relative = 0.0;  // of the golden value
  double angle = -1.0;    // rad, of the difference wrapped into (-pi, pi]; below 0: not an angle

  // Reads "CHANNEL:FIELD=abs:1e-3,rel:0.01,angle:0.02". Throws InputError.
  static DiffRule tolerance(std::string_view text);
  // Reads "CHANNEL" or "CHANNEL:FIELD". Throws InputError.
  static DiffRule ignoring(std::string_view text);
  // The rules of a command line. Throws InputError.
  static std::vector<DiffRule> all(const std::vector<std::string>& tolerances,
                                   const std::vector<std::string>& ignored);
};

// Whether a value may stand where the golden log has its own. rule: null where none fits.
bool passes(const FieldValue& golden, const FieldValue& other, const DiffRule* rule);

// A number, integers exactly; none of text, bytes and booleans.
std::optional<long double> number_of(const FieldValue& value);

struct FieldDifference {
  struct Sample {
    SimTime time;
    double golden, other;
  };

  int64_t count = 0;   // values beyond the tolerance
  double worst = 0.0;  // largest difference of numbers
  SimTime first_time = 0;
  std::string first_path, first_golden, first_other;
  std::vector<Sample> samples;  // of the element that differed first, thinned out, for a plot
};

struct ChannelDifference {
  std::string type;                // "" when unknown
  int64_t compared = 0;            // messages in both logs
  int64_t missing = 0, extra = 0;  // messages in one log only
  SimTime first_missing = 0, first_extra = 0;
  std::map<std::string, FieldDifference>
      fields;  // by FieldPath::pattern(); "(bytes)" for unknown types
  bool same() const { return missing == 0 && extra == 0 && fields.empty(); }
};

struct Diff {
  std::map<std::string, ChannelDifference> channels;
  // Why the logs are not the same even if no channel differs, a line each: a log that is cut or
  // damaged, nothing that was compared.
  std::vector<std::string> faults;
  std::vector<std::string> notes;  // other machines; logs that are known to be cut
  // A line for each rule that fits no channel of either log, or no field there: a name that is
  // spelt wrongly, or a rule that is for other logs as well.
  std::vector<std::string> idle_rules;
  bool same() const;
};

// Throws InputError when one of them is not a log, and when the rules ignore all of both. partial:
// a log that is cut or damaged is compared up to there. goes_on: called now and then; if it
// returns false, the comparison ends and its result is returned.
Diff diff_logs(const std::string& golden, const std::string& other,
               const std::vector<DiffRule>& rules, bool partial = false,
               const std::function<bool()>& goes_on = {});

std::string diff_text(const Diff& diff);   // for a terminal
std::string diff_junit(const Diff& diff);  // JUnit XML: one test case a channel
std::string diff_html(const Diff& diff, const std::string& golden,
                      const std::string& other);  // one page, plots inside

}  // namespace ruedo::log
