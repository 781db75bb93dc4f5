#include "bridges/dds/sockets.h"

#include <dds/ddsi/ddsi_domaingv.h>

void ruedo_visit_senders(void* domain, void (*visit)(struct ddsi_tran_conn* socket)) {
  struct ddsi_domaingv* known = domain;
  for (int i = 0; i < MAX_XMIT_CONNS; ++i) {
    if (known->xmit_conns[i]) visit(known->xmit_conns[i]);
  }
}

void ruedo_visit_receivers(void* domain, void (*visit)(struct ddsi_tran_conn* socket)) {
  struct ddsi_domaingv* known = domain;
  struct ddsi_tran_conn* const receivers[] = {known->disc_conn_uc, known->data_conn_uc,
                                              known->disc_conn_mc, known->data_conn_mc};
  for (size_t i = 0; i < sizeof receivers / sizeof *receivers; ++i) {
    if (receivers[i]) visit(receivers[i]);
  }
}
