// The header of a log: what the run was made from, and the machine's part in its bytes.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "ruedo/log_header_t.hpp"
#include "world/model/world_model.h"

namespace ruedo::log {

// The channels of records, which are in logs alone.
inline const std::string kHeaderChannel = "ruedo/header", kAppliedChannel = "ruedo/applied",
                         kStateHashChannel = "ruedo/state_hash";

// The processor's family, then the vector extensions of this CPU that libraries choose code by:
// "x86-64 sse4.2 avx".
std::string cpu_features();
// A hash of the sources that a run's bytes come from, and the compiler: the same in all programs
// of a build.
std::string own_sources();
// Ruedo's version with its sources, and the build of this program where the linker noted one: as a
// header has it.
std::string own_version();
std::string libc_version();
// Those shared libraries of this process that compute what goes into messages, by file name with
// version, sorted.
std::vector<std::string> libraries_that_matter();

// options: those that change the result, as on the command line.
log_header_t make_log_header(const world::WorldModel& world, uint64_t seed,
                             const std::vector<std::string>& options);

// With their SHA-256.
std::vector<log_file_t> hashed_files(const std::vector<std::string>& paths);

// A log may have been made elsewhere. A file that is not at its path is looked for beside the log
// and among Ruedo's own worlds, by the end of its path and its SHA-256. A file that is there but
// may not be read for an untrusted log (another installation's) is looked for among Ruedo's own
// worlds. The header then has the paths that were found.
void find_files_again(log_header_t& header, const std::string& log);

// "", or what is wrong with the names of its files: too many, or longer than any file's. None of
// them is looked for then.
std::string fault_of_names(const log_header_t& header);

// SHA-256 of files, each read once however often and by whatever names a log has it.
class Digests {
 public:
  const std::string& of(const std::string& path);  // as sha256_of_file()

 private:
  std::map<std::string, std::string> known_;  // by where links lead
};

// Throws InputError when a file that the log was made from is gone or was changed: names the first.
void check_files(const log_header_t& header, const std::string& log);
// The same for the models that came later in the log.
void check_files_of_spawned(const std::string& log);

// Of a log whose pictures Mesa's environment variables act on: an option for each, NAME=VALUE.
constexpr std::string_view kMesaOption = "--mesa-environment=";

// Other causes of different bytes that differ here, a line each: Ruedo's version and sources,
// the CPU, the C library, other libraries.
std::vector<std::string> machine_differences(const log_header_t& log, const log_header_t& here);

// Throws InputError when a run with the header `here` is another one than the log's: other files,
// options or steps.
void check_same_run(const log_header_t& log, const log_header_t& here, const std::string& path);

}  // namespace ruedo::log
