MODULE TaktStream
  ! EGM position stream: takt follows this robot (mapping: egm_sensor.yaml).
  ! Configuration, Communication, Transmission Protocol: Name UCdevice, Type UDPUC, Remote Address and Remote Port Number
  ! those of the machine of takt-egm (6510).
  VAR egmident egm;

  PROC main()
    EGMReset egm;
    EGMGetId egm;
    EGMSetupUC ROB_1, egm, "default", "UCdevice" \Joint;
    EGMStreamStart egm \SampleRate:=4;
    ! The ordinary program of the robot stands here.
    MoveAbsJ [[0, 0, 0, 0, 30, 0], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]], v200, fine, tool0;
    MoveAbsJ [[30, 10, 0, 0, 30, 0], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]], v200, fine, tool0;
    EGMStreamStop egm;
    EGMReset egm;
  ENDPROC
ENDMODULE
