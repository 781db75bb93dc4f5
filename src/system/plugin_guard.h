// Every call of a plugin's code goes through here.
//
// A plugin's sensors and drives are made inside of objects that call them. An exception of a call
// becomes an error with the plugin's name; rounding and other modes of arithmetic are as before
// when it returns; a message must match the sensor's announcement. A call that ends the process, or
// crashes, is reported on the terminal.
#pragma once

#include <string>

#include "ruedo/drive.h"
#include "ruedo/sensor.h"

namespace ruedo {

// The kind with a `make` whose sensors are guarded. plugin: the file's name.
SensorKind guarded(SensorKind kind, const std::string& plugin);
DriveKind guarded(DriveKind kind, const std::string& plugin);

// From now on a plugin's call that ends the process is reported. Handlers of the program's own for
// crashes stay.
void watch_plugin_calls();

}  // namespace ruedo
