// The sockets of a domain of Cyclone DDS. In C: the header that knows them is none of C++.
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

#include <stdbool.h>

struct ddsi_tran_conn;

// Those that it sends by. domain: a ddsi_domaingv.
void ruedo_visit_senders(void* domain, void (*visit)(struct ddsi_tran_conn* socket));
// Those that it receives by; one of them may be visited more than once.
void ruedo_visit_receivers(void* domain, void (*visit)(struct ddsi_tran_conn* socket));

// Whether the domain of a socket knows the writer with that GUID, as it is on the wire (16 bytes).
// To be called from a thread of Cyclone's.
bool ruedo_knows_writer(const struct ddsi_tran_conn* socket, const unsigned char* guid);

#ifdef __cplusplus
}
#endif
