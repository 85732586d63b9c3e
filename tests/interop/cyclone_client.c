// A client of another vendor: plain Cyclone DDS, types made by idlc. Drives a robot by joint_commands, reads its
// joint_states, the cell's state and its events.
// Usage: takt-test-cyclone DOMAIN CELL ROBOT. The cell must be playing; ends with 0 when all has been seen.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dds/dds.h"
#include "ros2_names_ros2_msgs.h"
#include "ros2_names_takt_msgs.h"

typedef sensor_msgs_msg_dds__JointState_ JointState;
typedef takt_msgs_msg_dds__CellState_ CellState;
typedef takt_msgs_msg_dds__Event_ Event;

static const double kDistance_rad = 0.02;

static dds_entity_t check(dds_entity_t made, const char* what) {
  if (made < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(-made));
    exit(2);
  }
  return made;
}

static dds_entity_t topic(dds_entity_t participant, const dds_topic_descriptor_t* type, const char* cell,
                          const char* name) {
  char full[256];
  snprintf(full, sizeof(full), "rt/%s/%s", cell, name);
  return check(dds_create_topic(participant, type, full, NULL, NULL), full);
}

/// The newest sample of a reader, on loan; false when there is none.
static bool take_one(dds_entity_t reader, void** sample) {
  dds_sample_info_t info;
  *sample = NULL;
  const dds_return_t count = dds_take(reader, sample, &info, 1, 1);
  if (count <= 0) return false;
  if (info.valid_data) return true;
  dds_return_loan(reader, sample, count);
  return false;
}

static void command(dds_entity_t writer, const JointState* present, const double* start, double first) {
  JointState message;
  memset(&message, 0, sizeof(message));
  double position[16];
  memcpy(position, start, sizeof(position));
  position[0] = first;
  message.header.frame_id = (char*)"";
  message.name = present->name;
  message.name._release = false;
  message.position._length = message.position._maximum = present->position._length;
  message.position._buffer = position;
  check(dds_write(writer, &message), "a command");
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const char* const cell = argv[2];
  char robot_topic[128];
  const dds_entity_t participant =
      check(dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL), "participant");
  dds_qos_t* const reliable = dds_create_qos();
  dds_qset_reliability(reliable, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(reliable, DDS_HISTORY_KEEP_LAST, 1000);
  dds_qos_t* const best_effort = dds_create_qos();
  dds_qset_reliability(best_effort, DDS_RELIABILITY_BEST_EFFORT, 0);
  snprintf(robot_topic, sizeof(robot_topic), "%s/joint_states", argv[3]);
  const dds_entity_t joints =
      check(dds_create_reader(participant,
                              topic(participant, &sensor_msgs_msg_dds__JointState__desc, cell, robot_topic),
                              reliable, NULL),
            "joint_states");
  const dds_entity_t states = check(
      dds_create_reader(participant, topic(participant, &takt_msgs_msg_dds__CellState__desc, cell, "state"),
                        best_effort, NULL),
      "state");
  const dds_entity_t events = check(
      dds_create_reader(participant, topic(participant, &takt_msgs_msg_dds__Event__desc, cell, "events"),
                        reliable, NULL),
      "events");
  snprintf(robot_topic, sizeof(robot_topic), "%s/joint_commands", argv[3]);
  const dds_entity_t commands =
      check(dds_create_writer(participant,
                              topic(participant, &sensor_msgs_msg_dds__JointState__desc, cell, robot_topic),
                              reliable, NULL),
            "joint_commands");
  const dds_entity_t waitset = check(dds_create_waitset(participant), "waitset");
  dds_set_status_mask(joints, DDS_DATA_AVAILABLE_STATUS);
  check(dds_waitset_attach(waitset, joints, 0), "waitset");

  double start[16] = {0.0};
  bool known = false, arrived = false, applied = false, rejected = false;
  // Every joint state is answered by a command, until its effects have been seen: in the joint states, in the
  // state of the cell, and, of a command beyond the limits, in an event. The bound ends a broken cell.
  for (int round = 0; round < 20000 && !(arrived && applied && rejected); ++round) {
    dds_attach_t triggered[1];
    if (dds_waitset_wait(waitset, triggered, 1, DDS_SECS(30)) <= 0) break;
    void* sample = NULL;
    while (take_one(joints, &sample)) {
      const JointState* const present = sample;
      if (present->position._length == 0 || present->position._length > 16 ||
          present->name._length != present->position._length) {
        return 3;
      }
      if (!known) {
        memcpy(start, present->position._buffer, present->position._length * sizeof(double));
        printf("first joint: %s, frame: %s\n", present->name._buffer[0], present->header.frame_id);
        known = true;
      }
      arrived = arrived || fabs(present->position._buffer[0] - start[0] - kDistance_rad) < 1e-12;
      command(commands, present, start, arrived && applied ? 100.0 : start[0] + kDistance_rad);
      dds_return_loan(joints, &sample, 1);
    }
    while (take_one(states, &sample)) {
      const CellState* const state = sample;
      for (uint32_t i = 0; i < state->applied._length; ++i) {
        if (strcmp(state->applied._buffer[i].target, argv[3]) == 0 && state->applied._buffer[i].count > 0)
          applied = true;
      }
      dds_return_loan(states, &sample, 1);
    }
    while (take_one(events, &sample)) {
      const Event* const event = sample;
      if (strcmp(event->code, "command_rejected") == 0 && strcmp(event->subject, argv[3]) == 0 && !rejected) {
        printf("%s\n", event->message);
        rejected = true;
      }
      dds_return_loan(events, &sample, 1);
    }
  }
  printf("arrived %d, applied %d, rejected %d\n", arrived, applied, rejected);
  dds_delete_qos(reliable);
  dds_delete_qos(best_effort);
  dds_delete(participant);
  return arrived && applied && rejected ? 0 : 1;
}
