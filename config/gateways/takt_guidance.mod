MODULE TaktGuidance
  ! EGM position guidance: the program that takt-egm stands in for (mapping: egm_controller.yaml). The same sensor program
  ! moves takt's robot and this one.
  VAR egmident egm;

  PROC main()
    MoveAbsJ CJointT(), v1000, fine, tool0;
    EGMReset egm;
    EGMGetId egm;
    EGMSetupUC ROB_1, egm, "default", "UCdevice" \Joint \CommTimeout:=1;
    EGMActJoint egm \SampleRate:=4 \MaxPosDeviation:=1000 \MaxSpeedDeviation:=1000;
    EGMRunJoint egm, EGM_STOP_HOLD \J1 \J2 \J3 \J4 \J5 \J6 \CondTime:=1000000 \RampInTime:=0.05;
    EGMReset egm;
  ENDPROC
ENDMODULE
