#include "dds/sockets.h"

#include <dds/ddsi/ddsi_domaingv.h>

void ruedo_visit_sockets(void* domain, void (*visit)(struct ddsi_tran_conn* socket)) {
  struct ddsi_domaingv* known = domain;
  for (int i = 0; i < MAX_XMIT_CONNS; ++i) {
    if (known->xmit_conns[i]) visit(known->xmit_conns[i]);
  }
}
