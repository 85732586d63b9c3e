// Callers of services as rclcpp on rmw_cyclonedds is on the wire: plain Cyclone DDS, types made by idlc, caller and number
// of each request ahead of its message.
// Usage: takt-test-cyclone-service DOMAIN CELL ROUNDS. In each round a participant with two clients of one service: each
// calls as soon as it sees the server, once, and waits for its reply. Then a client of another service calls with good and
// bad arguments. Prints what it gets; ends with 0 if each call has had its reply.
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dds/dds.h"
#include "service_peer.h"

#define TYPE(name) simulation_interfaces_srv_dds__##name
typedef TYPE(GetCurrentWorld_Request_) CurrentRequest;
typedef TYPE(GetCurrentWorld_Response_) CurrentResponse;
typedef TYPE(GetAvailableWorlds_Request_) WorldsRequest;
typedef TYPE(GetAvailableWorlds_Response_) WorldsResponse;

static dds_entity_t check(dds_entity_t made, const char* what) {
  if (made < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(-made));
    exit(2);
  }
  return made;
}

typedef struct {
  dds_entity_t requests, replies;
} Client;

static dds_entity_t topic(dds_entity_t participant, const dds_topic_descriptor_t* type, const char* prefix,
                          const char* cell, const char* name) {
  char full[256];
  snprintf(full, sizeof(full), "%s/%s/%s", prefix, cell, name);
  return check(dds_create_topic(participant, type, full, NULL, NULL), full);
}

/// The two ends are made, and the client waits for the server as wait_for_service() does.
static Client connect_client(dds_entity_t requests, dds_entity_t replies, dds_entity_t participant) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  Client client = {check(dds_create_writer(participant, requests, qos, NULL), "writer"),
                   check(dds_create_reader(participant, replies, qos, NULL), "reader")};
  dds_delete_qos(qos);
  for (int i = 0; i < 600000; ++i) {
    dds_subscription_matched_status_t s;
    dds_publication_matched_status_t p;
    dds_get_subscription_matched_status(client.replies, &s);
    dds_get_publication_matched_status(client.requests, &p);
    if (s.current_count == 1 && p.current_count == 1) return client;
    dds_sleepfor(DDS_USECS(100));
  }
  fprintf(stderr, "no service\n");
  exit(3);
}

/// The reply with this guid, on loan; NULL if it does not come.
static void* await_reply(dds_entity_t replies, uint64_t guid) {
  for (int i = 0; i < 50000; ++i) {
    void* sample = NULL;
    dds_sample_info_t info;
    if (dds_take(replies, &sample, &info, 1, 1) > 0) {
      if (info.valid_data && *(const uint64_t*)sample == guid) return sample;
      dds_return_loan(replies, &sample, 1);
    } else {
      dds_sleepfor(DDS_USECS(100));
    }
  }
  return NULL;
}

static WorldsResponse* worlds(const Client* client, uint64_t guid, char* source, bool continue_on_error) {
  WorldsRequest request;
  memset(&request, 0, sizeof(request));
  request.guid = guid;
  request.number = 1;
  request.continue_on_error = continue_on_error;
  if (source != NULL) {
    request.additional_sources._buffer = &source;
    request.additional_sources._length = request.additional_sources._maximum = 1;
  }
  check(dds_write(client->requests, &request), "a request");
  WorldsResponse* const response = await_reply(client->replies, guid);
  if (response == NULL) exit(4);
  return response;
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const dds_domainid_t domain = (dds_domainid_t)atoi(argv[1]);
  const char* const cell = argv[2];
  const int rounds = atoi(argv[3]);
  int lost = 0;
  for (int round = 0; round < rounds; ++round) {
    const dds_entity_t participant = check(dds_create_participant(domain, NULL, NULL), "participant");
    const dds_entity_t requests =
        topic(participant, &TYPE(GetCurrentWorld_Request__desc), "rq", cell, "get_current_worldRequest");
    const dds_entity_t replies =
        topic(participant, &TYPE(GetCurrentWorld_Response__desc), "rr", cell, "get_current_worldReply");
    for (int each = 0; each < 2; ++each) {
      const Client client = connect_client(requests, replies, participant);
      CurrentRequest request = {(uint64_t)(2 * round + each + 1), 1, 0};
      check(dds_write(client.requests, &request), "a request");
      CurrentResponse* response = await_reply(client.replies, request.guid);
      if (response == NULL) ++lost;
      if (response != NULL && round == 0 && each == 0)
        printf("current: %u %s\n", response->result.result, response->world.name);
      if (response != NULL) dds_return_loan(client.replies, (void**)&response, 1);
    }
    dds_delete(participant);
  }
  printf("calls: %d, lost: %d\n", 2 * rounds, lost);

  const dds_entity_t participant = check(dds_create_participant(domain, NULL, NULL), "participant");
  const Client client = connect_client(
      topic(participant, &TYPE(GetAvailableWorlds_Request__desc), "rq", cell, "get_available_worldsRequest"),
      topic(participant, &TYPE(GetAvailableWorlds_Response__desc), "rr", cell, "get_available_worldsReply"),
      participant);
  char nowhere[] = "nowhere";
  const WorldsResponse* const all = worlds(&client, 1000001, NULL, false);
  printf("worlds: %u, %u of them", all->result.result, all->worlds._length);
  for (uint32_t i = 0; i < all->worlds._length; ++i) printf(" %s", all->worlds._buffer[i].name);
  printf("\n");
  printf("worlds of nowhere: %u\n", worlds(&client, 1000002, nowhere, false)->result.result);
  printf("worlds all the same: %u\n", worlds(&client, 1000003, nowhere, true)->result.result);
  dds_delete(participant);
  return lost == 0 ? 0 : 1;
}
