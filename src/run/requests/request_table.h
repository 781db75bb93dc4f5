// The properties of each kind of request: whether this server serves it, when it may be executed,
// and its function.
//
// A new request is a line of the table in requests.cpp and a function of Run. The
// server's features, its refusals with their reasons, and the requests that a repetition of the log
// executes follow from the table.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/request_t.hpp"
#include "run/requests/sessions.h"

namespace ruedo::run {

class Run;

struct RequestKind {
  enum Needs { nothing, grants, snapshots, save_file };  // of the server
  enum Effect {
    looks,
    steers,
    acts
  };  // reads; changes the run's pace or state; changes the world, and is repeated from logs
  enum Waits { for_nothing, for_state };  // for the first state: what reads or changes the world

  const char* name;
  int32_t kind;
  Needs needs;
  Effect effect;
  Waits waits;
  // Decodes, checks, executes. Null: JOIN and LEAVE, which Control sees to.
  engine::Outcome (*execute)(Run& run, const request_t& request, const Session& session);
};

// Null: there is no such kind.
const RequestKind* find_request_kind(int32_t kind);

// False for a body of another type, or has bytes left over.
template <class Body>
bool read_body(const request_t& request, Body& body) {
  return decode_checked(request.body.data(), request.body.size(), body) == DecodeFault::none;
}

template <class Body>
engine::Outcome bad_body() {
  return engine::Outcome::refuse(reply_t::BAD_REQUEST,
                                 std::string("the body is not a ") + Body::getTypeName());
}

}  // namespace ruedo::run
