// An action client of another vendor, as rclcpp_action on rmw_cyclonedds is on the wire: plain Cyclone DDS, types made by
// idlc, caller and number of each request ahead of its message.
// Usage: takt-test-cyclone-action DOMAIN CELL ROBOT DURATION_S FIRST_rad NAME... (of the joints; the other joints go to
// where the test cell begins). Prints what it sees; with DURATION_S above 100 it cancels its goal after some feedback.
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "action_peer.h"
#include "dds/dds.h"

#define TYPE(name) control_msgs_action_dds__FollowJointTrajectory_##name
typedef TYPE(SendGoal_Request_) SendRequest;
typedef TYPE(SendGoal_Response_) SendResponse;
typedef TYPE(GetResult_Request_) ResultRequest;
typedef TYPE(GetResult_Response_) ResultResponse;
typedef TYPE(FeedbackMessage_) Feedback;
typedef action_msgs_srv_dds__CancelGoal_Request_ CancelRequest;
typedef action_msgs_srv_dds__CancelGoal_Response_ CancelResponse;
typedef action_msgs_msg_dds__GoalStatusArray_ StatusArray;

static const uint64_t kGuid = 0x1122334455667788ULL;

static dds_entity_t check(dds_entity_t made, const char* what) {
  if (made < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(-made));
    exit(2);
  }
  return made;
}

static dds_entity_t participant;
static const char *cell, *robot;

static dds_entity_t topic(const dds_topic_descriptor_t* type, const char* prefix, const char* name) {
  char full[256];
  snprintf(full, sizeof(full), "%s/%s/%s/follow_joint_trajectory/_action/%s", prefix, cell, robot, name);
  return check(dds_create_topic(participant, type, full, NULL, NULL), full);
}

static dds_entity_t reader(const dds_topic_descriptor_t* type, const char* prefix, const char* name, dds_qos_t* qos) {
  return check(dds_create_reader(participant, topic(type, prefix, name), qos, NULL), name);
}

static dds_entity_t writer(const dds_topic_descriptor_t* type, const char* name, dds_qos_t* qos) {
  return check(dds_create_writer(participant, topic(type, "rq", name), qos, NULL), name);
}

/// Waits for exactly one match: a service has one reader and one writer. A call follows at once, as behind a change of
/// ROS 2's graph.
static void match_one(dds_entity_t read, dds_entity_t write) {
  for (int i = 0; i < 60000; ++i) {
    dds_subscription_matched_status_t s;
    dds_publication_matched_status_t p;
    dds_get_subscription_matched_status(read, &s);
    dds_get_publication_matched_status(write, &p);
    if (s.current_count == 1 && p.current_count == 1) return;
    dds_sleepfor(DDS_MSECS(1));
  }
  fprintf(stderr, "a service has not exactly one reader and one writer\n");
  exit(3);
}

/// The next valid sample, on loan; NULL after this time.
static void* next_within(dds_entity_t read, int limit_ms) {
  for (int i = 0; i < limit_ms; ++i) {
    void* sample = NULL;
    dds_sample_info_t info;
    const dds_return_t count = dds_take(read, &sample, &info, 1, 1);
    if (count > 0 && info.valid_data) return sample;
    if (count > 0) dds_return_loan(read, &sample, count);
    dds_sleepfor(DDS_MSECS(1));
  }
  return NULL;
}

static void* await(dds_entity_t read) {
  void* sample = next_within(read, 60000);
  if (sample != NULL) return sample;
  fprintf(stderr, "no sample\n");
  exit(4);
}

/// Writes the request and waits for its reply; others are for other callers.
#define CALL(Type, made, read, write, request)                 \
  ++(request).number;                                          \
  check(dds_write(write, &(request)), #request);               \
  Type* made = await(read);                                    \
  while (made->guid != kGuid || made->number != (request).number) { \
    void* other = made;                                        \
    dds_return_loan(read, &other, 1);                          \
    made = await(read);                                        \
  }

int main(int argc, char** argv) {
  if (argc != 12) return 2;
  setvbuf(stdout, NULL, _IOLBF, 0);
  cell = argv[2], robot = argv[3];
  const double duration_s = atof(argv[4]);
  participant = check(dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL), "participant");
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1000);
  dds_qos_t* const latched = dds_create_qos();
  dds_copy_qos(latched, qos);
  dds_qset_durability(latched, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t sent = reader(&TYPE(SendGoal_Response__desc), "rr", "send_goalReply", qos);
  const dds_entity_t send = writer(&TYPE(SendGoal_Request__desc), "send_goalRequest", qos);
  const dds_entity_t got = reader(&TYPE(GetResult_Response__desc), "rr", "get_resultReply", qos);
  const dds_entity_t get = writer(&TYPE(GetResult_Request__desc), "get_resultRequest", qos);
  const dds_entity_t cancelled = reader(&action_msgs_srv_dds__CancelGoal_Response__desc, "rr", "cancel_goalReply", qos);
  const dds_entity_t cancel = writer(&action_msgs_srv_dds__CancelGoal_Request__desc, "cancel_goalRequest", qos);
  const dds_entity_t feedback = reader(&TYPE(FeedbackMessage__desc), "rt", "feedback", qos);
  const dds_entity_t status = reader(&action_msgs_msg_dds__GoalStatusArray__desc, "rt", "status", latched);
  match_one(sent, send);
  match_one(got, get);
  match_one(cancelled, cancel);
  StatusArray* first = await(status);
  printf("goals at first: %u\n", first->status_list._length);

  SendRequest request;
  memset(&request, 0, sizeof(request));
  request.guid = kGuid;
  memset(request.goal_id, 0xC7, sizeof(request.goal_id));
  const pid_t own = getpid();
  memcpy(request.goal_id, &own, sizeof(own));
  char empty[] = "";
  request.trajectory.header.frame_id = request.multi_dof_trajectory.header.frame_id = empty;
  double positions[] = {atof(argv[5]), -1.5707963267948966, 1.5707963267948966, -1.5707963267948966, -1.5707963267948966, 0.0};
  double velocities[6] = {0};
  peer_dds__Point point;
  memset(&point, 0, sizeof(point));
  point.positions._buffer = positions, point.positions._length = point.positions._maximum = 6;
  point.velocities._buffer = velocities, point.velocities._length = point.velocities._maximum = 6;
  point.time_from_start.sec = (int)duration_s;
  point.time_from_start.nanosec = (unsigned)((duration_s - (int)duration_s) * 1e9);
  request.trajectory.joint_names._buffer = argv + 6;
  request.trajectory.joint_names._length = request.trajectory.joint_names._maximum = 6;
  request.trajectory.points._buffer = &point;
  request.trajectory.points._length = request.trajectory.points._maximum = 1;
  CALL(SendResponse, response, sent, send, request)
  printf("accepted: %d\n", response->accepted);
  if (!response->accepted) return 5;

  ResultRequest asking;
  memset(&asking, 0, sizeof(asking));
  asking.guid = kGuid, asking.number = 7;
  memcpy(asking.goal_id, request.goal_id, sizeof(asking.goal_id));
  check(dds_write(get, &asking), "get_result");
  for (int i = 0; i < 3; ++i) {
    Feedback* one = await(feedback);
    while (memcmp(one->goal_id, request.goal_id, sizeof(one->goal_id)) != 0) one = await(feedback);
    printf("feedback: %u joints, %u positions, %u of several degrees of freedom\n", one->joint_names._length,
           one->actual.positions._length, one->multi_dof_joint_names._length);
  }
  if (duration_s > 100.0) {
    CancelRequest stop;
    memset(&stop, 0, sizeof(stop));
    stop.guid = kGuid;
    memcpy(stop.goal_id, request.goal_id, sizeof(stop.goal_id));
    CALL(CancelResponse, stopped, cancelled, cancel, stop)
    printf("cancel: code %d, %u goals\n", stopped->return_code, stopped->goals_canceling._length);
  }
  CALL(ResultResponse, result, got, get, asking)
  printf("result: status %d, error %d, %s\n", result->status, result->error_code, result->error_string);
  check(dds_delete(participant), "the end");
  return 0;
}
