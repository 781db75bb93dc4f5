#include "bridges/dds/sockets.h"

#include <dds/ddsi/ddsi_domaingv.h>
#include <dds/ddsi/ddsi_entity_index.h>
#include <dds/ddsi/ddsi_tran.h>
#include <dds/ddsi/q_thread.h>

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

static uint32_t number_at(const unsigned char* bytes) {
  return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

bool ruedo_knows_writer(const struct ddsi_tran_conn* socket, const unsigned char* guid) {
  const struct ddsi_domaingv* domain = socket->m_base.gv;
  ddsi_guid_t key;
  for (int i = 0; i < 3; ++i) key.prefix.u[i] = number_at(guid + 4 * i);
  key.entityid.u = number_at(guid + 12);
  struct thread_state* thread = lookup_thread_state();
  thread_state_awake(thread, domain);
  const bool known = entidx_lookup_proxy_writer_guid(domain->entity_index, &key) != NULL;
  thread_state_asleep(thread);
  return known;
}
