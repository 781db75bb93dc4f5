// --sandbox of the commands that read untrusted files.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ruedo::cli {

void add_sandbox_argument(CLI::App& command, bool& sandboxed);

// Before any thread is started. file: the world or log; its folder, the models in and beside it,
// and the folders of RUEDO_PATH and its kin stay readable. written: files and folders that the
// command writes; "" are passed over. other: a second file that is read; "" for none. Throws
// EnvironmentError where the kernel has no sandbox.
void enter_sandbox(const std::string& file, const std::vector<std::string>& written,
                   const std::string& other = "");

}  // namespace ruedo::cli
