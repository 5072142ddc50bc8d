"""ROS 2's messages for PyPI's cyclonedds, written from ROS 2's .msg files and not from Berth's sources.

Types and members are named as ROS 2's own IDL names them: pkg::msg::dds_::Name_, and an underscore behind each member.
"""
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec_: int32
    nanosec_: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp_: Time
    frame_id_: str


@dataclass
@final
class Point(IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x_: float64
    y_: float64
    z_: float64


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x_: float64
    y_: float64
    z_: float64


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x_: float64
    y_: float64
    z_: float64
    w_: float64


@dataclass
@final
class Pose(IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position_: Point
    orientation_: Quaternion


@dataclass
@final
class PoseStamped(IdlStruct, typename="geometry_msgs.msg.dds_.PoseStamped_"):
    header_: Header
    pose_: Pose


@dataclass
@final
class PoseWithCovariance(IdlStruct, typename="geometry_msgs.msg.dds_.PoseWithCovariance_"):
    pose_: Pose
    covariance_: array[float64, 36]


@dataclass
@final
class PoseWithCovarianceStamped(IdlStruct, typename="geometry_msgs.msg.dds_.PoseWithCovarianceStamped_"):
    header_: Header
    pose_: PoseWithCovariance


@dataclass
@final
class Transform(IdlStruct, typename="geometry_msgs.msg.dds_.Transform_"):
    translation_: Vector3
    rotation_: Quaternion


@dataclass
@final
class TransformStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TransformStamped_"):
    header_: Header
    child_frame_id_: str
    transform_: Transform


@dataclass
@final
class TFMessage(IdlStruct, typename="tf2_msgs.msg.dds_.TFMessage_"):
    transforms_: sequence[TransformStamped]


@dataclass
@final
class TagPoint(IdlStruct, typename="apriltag_msgs.msg.dds_.Point_"):
    x_: float64
    y_: float64


@dataclass
@final
class AprilTagDetection(IdlStruct, typename="apriltag_msgs.msg.dds_.AprilTagDetection_"):
    family_: str
    id_: int32
    hamming_: int32
    goodness_: float32
    decision_margin_: float32
    centre_: TagPoint
    corners_: array[TagPoint, 4]
    homography_: array[float64, 9]


@dataclass
@final
class AprilTagDetectionArray(IdlStruct, typename="apriltag_msgs.msg.dds_.AprilTagDetectionArray_"):
    header_: Header
    detections_: sequence[AprilTagDetection]


@dataclass
@final
class RegionOfInterest(IdlStruct, typename="sensor_msgs.msg.dds_.RegionOfInterest_"):
    x_offset_: uint32
    y_offset_: uint32
    height_: uint32
    width_: uint32
    do_rectify_: bool


@dataclass
@final
class CameraInfo(IdlStruct, typename="sensor_msgs.msg.dds_.CameraInfo_"):
    header_: Header
    height_: uint32
    width_: uint32
    distortion_model_: str
    d_: sequence[float64]
    k_: array[float64, 9]
    r_: array[float64, 9]
    p_: array[float64, 12]
    binning_x_: uint32
    binning_y_: uint32
    roi_: RegionOfInterest


@dataclass
@final
class CompressedImage(IdlStruct, typename="sensor_msgs.msg.dds_.CompressedImage_"):
    header_: Header
    format_: str
    data_: sequence[uint8]


@dataclass
@final
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key_: str
    value_: str


@dataclass
@final
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    level_: uint8
    name_: str
    message_: str
    hardware_id_: str
    values_: sequence[KeyValue]


@dataclass
@final
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header_: Header
    status_: sequence[DiagnosticStatus]
