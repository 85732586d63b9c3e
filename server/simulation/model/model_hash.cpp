#include "server/simulation/model/model_hash.h"

#include <string_view>
#include <type_traits>

#include "server/geometry/surface/contact_surface_data.h"
#include "server/simulation/model/state_hash.h"

namespace takt {

namespace {

class ModelHash {
 public:
  template <typename T>
  requires std::is_integral_v<T> || std::is_enum_v<T> ModelHash& operator<<(T value) {
    hash_.add(static_cast<std::uint64_t>(value));
    return *this;
  }
  ModelHash& operator<<(double value) { return hash_.add(value), *this; }
  ModelHash& operator<<(std::string_view text) {
    *this << text.size();
    for (const char letter : text) *this << letter;
    return *this;
  }
  ModelHash& operator<<(const std::string& text) { return *this << std::string_view(text); }
  template <int kRows, int kColumns>
  ModelHash& operator<<(const Eigen::Matrix<double, kRows, kColumns>& m) {
    hash_.add(std::span<const double>(m.data(), static_cast<std::size_t>(m.size())));
    return *this;
  }
  ModelHash& operator<<(const Pose& X) { return *this << X.R << X.p; }
  ModelHash& operator<<(const Twist& V) { return *this << V.v << V.w; }
  template <std::size_t kSize>
  ModelHash& operator<<(const std::array<double, kSize>& values) {
    return hash_.add(std::span<const double>(values)), *this;
  }
  template <typename T>
  ModelHash& operator<<(const std::vector<T>& values) {
    *this << values.size();
    for (const T& value : values) *this << value;
    return *this;
  }
  template <typename T>
  ModelHash& operator<<(const std::optional<T>& value) {
    *this << value.has_value();
    return value ? *this << *value : *this;
  }

  ModelHash& operator<<(const SolverParameters& p) {
    return *this << p.name << p.tolerance << p.step_s << p.matrix;
  }
  ModelHash& operator<<(const ConvexShape& shape) { return *this << shape.vertices; }
  ModelHash& operator<<(const SubstituteParameters& p) {
    return *this << p.k_tr_N_per_m << p.d_tr_N_s_per_m << p.K_rot_B << p.D_rot_B;
  }
  ModelHash& operator<<(const Component& c) {
    return *this << c.name << c.type << c.hierarchy << c.convex << c.mass_kg << c.p_BBcm << c.I_BBcm_B
                 << c.substitute << c.gripper << c.role;
  }
  ModelHash& operator<<(const ComponentPair& pair) { return *this << pair.base << pair.target << pair.kind; }
  ModelHash& operator<<(const InteractionParameters& p) {
    // Not skip_resting: the bits are the same.
    return *this << p.gravity_W << p.contact_margin_m << p.weight_feed_forward << p.algorithm;
  }
  ModelHash& operator<<(const RigidBodyParameters& p) {
    return *this << p.body << p.mass_kg << p.p_BBcm << p.I_BBcm_B << p.gravity_W << p.X_WB_initial
                 << p.V_WB_initial;
  }
  ModelHash& operator<<(const WorldBounds& bounds) { return *this << bounds.lower_W << bounds.upper_W; }
  ModelHash& operator<<(const GroundModel& ground) { return *this << ground.component << ground.X_WB; }
  ModelHash& operator<<(const JointModel& j) {
    return *this << j.name << j.type << j.X_PJ << j.axis << j.lower << j.upper << j.max_velocity
                 << j.max_effort;
  }
  ModelHash& operator<<(const ArmModel& arm) { return *this << arm.joints << arm.X_JF; }
  ModelHash& operator<<(const KinematicRobotParameters& p) {
    return *this << p.robot << p.arm << p.X_WR << p.q_initial;
  }
  ModelHash& operator<<(const BodyInertia& body) {
    return *this << body.mass_kg << body.p_BBcm_B << body.I_BBcm_B;
  }
  ModelHash& operator<<(const MountedGripper& p) {
    return *this << p.palm << p.jaw << p.servo_frequency_rad_per_s << p.max_force_N
                 << p.gear_frequency_rad_per_s;
  }
  ModelHash& operator<<(const DynamicRobotParameters& p) {
    return *this << p.robot << p.arm << p.links << p.X_WR << p.gravity_W << p.grippers << p.power.idle_W
                 << p.power.loss_factor << p.power.recovers;
  }
  ModelHash& operator<<(const DriveParameters& drive) {
    *this << drive.index();
    std::visit([this](const auto& p) { add(p); }, drive);
    return *this;
  }
  ModelHash& operator<<(const RobotDynamics& d) { return *this << d.parameters << d.drives; }
  ModelHash& operator<<(const TrajectoryKnot& knot) { return *this << knot.t << knot.q << knot.qd; }
  ModelHash& operator<<(const GripperModel& g) {
    const ParallelGripperParameters& p = g.parameters;
    return *this << p.robot << p.palm << p.jaws[0] << p.jaws[1] << p.X_FG << p.max_width_m
                 << p.initial_width_m << p.jaw_speed_m_per_s << g.rule << g.max_force_N << g.friction
                 << g.press_m << g.face_x_lower_m << g.face_x_upper_m << g.face_z_lower_m << g.face_z_upper_m;
  }
  ModelHash& operator<<(const std::shared_ptr<const ContactSurface>& surface) {
    if (surface == nullptr) return *this << 0;
    const ContactSurface::Data& data = surface->data();
    *this << data.px << data.py << data.pz << data.area_m2 << data.vertices << data.faces.size();
    for (const ContactFace& face : data.faces) *this << face.vertex[0] << face.vertex[1] << face.vertex[2];
    return *this;
  }
  ModelHash& operator<<(const ContactPairModel& pair) {
    const ContactLaw& law = pair.law;
    return *this << pair.base << pair.target << pair.force << law.stiffness_Pa_per_m << law.linear_depth_m
                 << law.areal_damping_Ns_per_m3 << law.damping_depth_m << law.friction
                 << law.friction_velocity_m_per_s << law.friction_law << law.tangential_stiffness_Pa_per_m
                 << law.tangential_damping_Ns_per_m3 << pair.friction_at_K;
  }
  ModelHash& operator<<(const ProcessDescription& process) {
    return *this << process.name << process.level_of_detail << process.robots << process.components;
  }
  ModelHash& operator<<(const CheckedBody& body) {
    return *this << body.name << body.robot << body.joint << body.component << body.shapes.size();
  }
  ModelHash& operator<<(const CheckedPair& pair) { return *this << pair.a << pair.b << pair.limit_m; }

  std::uint64_t value() const { return hash_.value(); }

 private:
  void add(const IdealServoParameters& p) {
    *this << p.frequency_rad_per_s << p.max_torque << p.velocity_feed_forward;
  }
  void add(const SimplifiedDriveParameters& p) {
    *this << p.gear_ratio << p.rotor_inertia_kg_m2 << p.load_inertia_kg_m2 << p.position_gain_per_s
          << p.speed_gain_per_s << p.integral_time_s << p.max_torque;
  }
  void add(const DetailedDriveParameters& p) {
    const FrictionParameters& f = p.friction;
    *this << p.elastic_gear << p.gear_ratio << p.motor_inertia_kg_m2 << p.motor_constant_Nm_per_A
          << p.current_loop_rad_per_s << p.current_loop_damping << p.resistance_ohm << p.power_stage_gain
          << p.gear_stiffness_Nm_per_rad << p.gear_damping_Nms_per_rad << f.zero_speed_Nm << f.slope_Nms
          << f.break_away << f.regularised << f.regularisation_speed_rad_per_s << p.position_gain_per_s
          << p.speed_gain_As_per_rad << p.speed_integral_time_s << p.position_at_joint;
  }

  StateHash hash_;
};

}  // namespace

std::uint64_t model_hash(const CellModel& model) {
  ModelHash hash;
  hash << model.step_s << model.solver << model.contact_solver << model.components << model.pairs
       << model.interaction << model.parts << model.grounds << model.bounds << model.robots << model.dynamics
       << model.robot_levels << model.trajectories << model.grippers << model.description.processes;
  for (const RobotDescription& robot : model.description.robots) {
    const CommandDeadline& deadline = robot.command_deadline;
    hash << robot.command_period_s << deadline.deadline_s << deadline.action << deadline.max_acceleration;
  }
  hash << model.contact.enabled << model.contact.surfaces << model.contact.pairs;
  for (const AuxiliaryModel& further : model.auxiliary_models)
    hash << further.name << further.device << further.identity;
  for (const DeviceDescription& device : model.description.devices) {
    hash << device.name << device.signals.size();
    for (const SignalDescription& signal : device.signals) hash << signal.name;
  }
  if (model.dynamics_solver) hash << *model.dynamics_solver;
  hash << model.clearance.enabled << model.clearance.hysteresis_m << model.clearance.bodies
       << model.clearance.pairs;
  return hash.value();
}

}  // namespace takt
