/// @file
// Samples and errors of Ruedo's client for C++. ruedo/client.h includes it.
//
// SI units, radians; x ahead, y left, z up; quaternions w, x, y, z. utime is sim time in
// microseconds.
#pragma once

#include <stdexcept>
#include <string>

#include "ruedo/client_enums.h"
#include "ruedo/client_messages.h"
#include "ruedo/client_types.h"

namespace ruedo::client {

// ---- Errors. Bad arguments (NaN, a radius of 0) are std::invalid_argument.

/// Any other failure; the text says which.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// No server answered, it fell silent or ended, or the Simulation was closed.
struct NoServer : Error {
  using Error::Error;
};
/// The run is over: its server has said so, or ended with exit code 0.
struct RunEnded : NoServer {
  using NoServer::NoServer;
};
/// A private server could not be started.
struct LaunchError : Error {
  using Error::Error;
};
/// The text lists the names that exist.
struct UnknownName : Error {
  using Error::Error;
};
/// No message or reply came within the timeout.
struct Timeout : Error {
  using Error::Error;
};
/// A channel carries another version of a type.
struct TypeMismatch : Error {
  using Error::Error;
};
/// The server or the robot cannot do that.
struct NotSupported : Error {
  using Error::Error;
};
/// A primitive ended early or was refused.
struct MotionError : Error {
  /// @cond
  MotionError(const std::string& text, MotionReason why) : Error(text), reason(why) {}
  /// @endcond
  MotionReason reason;  ///< of its end
};
/// The server refused a request.
struct RequestError : Error {
  /// @cond
  RequestError(const std::string& text, ReplyCode reply_code) : Error(text), code(reply_code) {}
  /// @endcond
  ReplyCode code;  ///< of the refusal
};
/// Lockstep continues without this client, which was silent too long; the next step() takes part
/// again.
struct LeaseLost : RequestError {
  using RequestError::RequestError;
};

}  // namespace ruedo::client
