// Parses options as users write them, strictly: errors show the expected form.
#include <charconv>
#include <cmath>
#include <string_view>

#include "base/option_text.h"
#include "ruedo/errors.h"
#include "world/load.h"

namespace ruedo::world {
Spawn parse_spawn(const std::string& text) {
  const std::string allowed =
      "it looks like MODEL[:NAME]@X,Y[,YAW], for example p3at:rover@1,2.5,1.57";
  const size_t at = text.rfind('@');
  if (at == std::string::npos || at == 0) refuse_option("--spawn", text, allowed);
  Spawn spawn;
  spawn.model = text.substr(0, at);
  if (const size_t colon = spawn.model.rfind(':');
      colon != std::string::npos && spawn.model.find('/', colon) == std::string::npos) {
    spawn.name = spawn.model.substr(colon + 1);
    spawn.model.resize(colon);
    if (spawn.name.empty() || spawn.model.empty()) refuse_option("--spawn", text, allowed);
  }
  double numbers[3] = {0.0, 0.0, 0.0};
  int count = 0;
  for (size_t begin = at + 1; begin <= text.size(); ++count) {
    const size_t end = std::min(text.find(',', begin), text.size());
    if (count == 3 ||
        !read_number(std::string_view(text).substr(begin, end - begin), numbers[count]))
      refuse_option("--spawn", text, allowed);
    begin = end + 1;
  }
  if (count < 2) refuse_option("--spawn", text, allowed);
  spawn.x = numbers[0];
  spawn.y = numbers[1];
  spawn.yaw = numbers[2];
  return spawn;
}

DriveOption parse_drive(const std::string& text) {
  const std::string allowed =
      "it looks like ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...], for example "
      "rover=left_wheel_joint,right_wheel_joint";
  const size_t equals = text.find('='),
               comma = text.find(',', equals == std::string::npos ? 0 : equals);
  if (equals == std::string::npos || equals == 0 || comma == std::string::npos)
    refuse_option("--drive", text, allowed);
  const auto joints = [&](size_t begin, size_t end) {
    std::vector<std::string> names;
    while (begin <= end) {
      const size_t plus = std::min(text.find('+', begin), end);
      names.push_back(text.substr(begin, plus - begin));
      if (names.back().empty() || names.back().find(',') != std::string::npos)
        refuse_option("--drive", text, allowed);
      begin = plus + 1;
    }
    return names;
  };
  return {text.substr(0, equals), joints(equals + 1, comma), joints(comma + 1, text.size())};
}

Setting parse_setting(const std::string& text) {
  const std::string allowed =
      "it looks like ROBOT/DEVICE.KEY=VALUE, for example p3at/LRF.update_rate=20";
  const size_t slash = text.find('/');
  const size_t dot = text.find('.', slash == std::string::npos ? 0 : slash);
  const size_t equals = text.find('=');
  if (slash == std::string::npos || dot == std::string::npos || equals == std::string::npos ||
      !(slash < dot && dot < equals) || slash == 0 || dot == slash + 1 || equals == dot + 1) {
    refuse_option("--set", text, allowed);
  }
  return {text.substr(0, slash), text.substr(slash + 1, dot - slash - 1),
          text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)};
}

}  // namespace ruedo::world
