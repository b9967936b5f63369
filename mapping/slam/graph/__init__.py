"""Back end of SLAM: the pose graph of the keyframes, and the bundle adjustment of keyframes and walls."""
