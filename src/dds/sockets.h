// The sockets that a domain of Cyclone DDS sends by. In C: the header that knows them is none of
// C++.
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

struct ddsi_tran_conn;

// domain: a ddsi_domaingv.
void ruedo_visit_sockets(void* domain, void (*visit)(struct ddsi_tran_conn* socket));

#ifdef __cplusplus
}
#endif
