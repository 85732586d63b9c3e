#pragma once
// The reply to explain_part: its message is for a person, and its values carry the whole explanation as one
// JSON document, with the names of this cell. As a value holds at most 4096 characters, the document comes in
// pieces document_0, document_1, ..., to be put together in order; `pieces` says how many.
//
// The document (units SI, world frame):
//   part, type, hierarchy, state, state_because, explanation
//   time, step, epoch          the present instant
//   decided_at                 time of the contacts below: the beginning of the last step
//   partner, rule, contacts_to_partner, rival, contacts_to_rival      null: none; rules:
//   partner_explanation.h since: {time, step, before} sequence_count, sequences: [[name, ...], ...] those to
//   the partner first contact_count, contacts: [{a, b, distance, error, position, normal}]   negative
//   distance: penetration;
//                              null: not measured, there were too many
//   connections: [{target, force, moment, feed_forward, softening}]   on the Part at its centre of mass
//   surface_contact            it acts between the component and others (level of detail 3)
//   pressing: [{by, force, torque, center_of_pressure, elements, area, normal_force, friction_force,
//              largest_pressure, largest_penetration}]   on the component, torque about the centre of
//              pressure
//   held_count, held: [name, ...]
//   components: {name: {type, hierarchy}}      of all names above; hierarchy is null for what is not a Part
// A list is shorter than its count when not all is listed (ListingLimits, Explanation). Counts that are not
// exact in a double are saturated at 2^64 - 1.
#include "server/runtime/requests/control.h"
#include "server/simulation/step/explanation.h"

namespace takt {

ControlReply explanation_reply(std::uint64_t id, const Explanation& explanation, const CellDescription& cell);

}  // namespace takt
