"""Small logs written by hand, one per format."""

INDOOR = (
    "#\tstartTime:1574559495255\n"
    "#\tSiteID:5dd3\tSiteName:杭州\tFloorId:5dd4\tFloorName:F1\n"
    "#\tBrand:OPPO\tModel:PBCM10\tAndroidName:8.1.0\tAPILevel:27\t\n"
    "1574559495263\tTYPE_WAYPOINT\t81.25\t93.5\n"
    "1574559495401\tTYPE_ACCELEROMETER\t-0.5\t1.25\t9.75\t2\n"
    "1574559495401\tTYPE_GYROSCOPE\t-0.1\t0.2\t0.3\t3\n"
    "1574559495401\tTYPE_MAGNETIC_FIELD\t29.5\t6.5\t-30.25\t3\n"
    "1574559495401\tTYPE_ROTATION_VECTOR\t0.0\t0.6\t0.0\t3\n"
    "1574559495401\tTYPE_ACCELEROMETER_UNCALIBRATED\t-1.0\t2.0\t9.6\t0.0\t0.0\t0.0\t3\n"
    "1574559495421\tTYPE_ACCELEROMETER\t-0.25\t1.5\t9.5\t2\n"
    "1574559496436\tTYPE_BEACON\t9195B3AD\t0\t7\t-56\t-93\t45.03\tE0:78:A3:3D:B5:D6\t1574559496436\n"
    "1574559497191\tTYPE_WIFI\tFMI\tA8:0C:CA:03:9D:D7\t-49\t2422\t1574559495450\n"
    "1574559497191\tTYPE_WIFI\t\t74:ee:2a:cd:eb:43\t-53\t5785\t1574559490742\n"
    "1574559498500\tTYPE_WIFI\tFMI\ta8:0c:ca:03:9d:d7\t-51\t2422\t1574559498000\n"
    "1574559499000\tTYPE_ACCELEROMETER\t0.0\t1.0\t10.0\t2\n"
    "1574559499263\tTYPE_WAYPOINT\t80.25\t94.5\n"
    "#\tendTime:1574559499300\n"
).encode()

SENSOR = (
    b"% LogFile created by the 'GetSensorData' App for Android.\n"
    b"% Manufacturer:            \tsamsung\n"
    b"% Model:                   \tSM-A520F\n"
    b"ACCE;0.10;100.00;1.0;2.0;9.5;3\n"
    b"ACCE;0.15;100.02;1.1;2.1;9.6;3\n"
    b"ACCE;0.14;100.04;1.2;2.2;9.7;3\n"
    b"ACCE;9.00;108.92;1.2;2.2;9.7;3\n"
    b"GYRO;0.10;100.00;0.1;0.2;0.3;3\n"
    b"MAGN;0.10;100.00;-2.0;-34.0;-45.0;0\n"
    b"AHRS;0.11;100.00;49.9;11.5;-16.5;0.6;0.0;0.0;3\n"
    b"WIFI;0.651;94.18;net;20:23:00:00:00:0A;2437;-60\n"
    b"WIFI;0.750;94.18;odd;name;20:23:00:00:00:15;2452;-63\n"
    b"WIFI;4.651;98.18;net;20:23:00:00:00:0a;2437;-61\n"
    b"BLE4;2.8313;iBeacon;BE:AC:20:23:00:01;-90;0;1;1;11111111-1111-BEAC-2023-111111111111\n"
    b"PRES;0.1;100.0;964.5;3\n"
    b"POSI;1.0;1;49.461316433032;11.110964442580;2;100\n"
    b"POSI;5.0;2;49.461416433032;11.111064442580;2;100\n"
)

WIFINE = (
    b"0,1,2,num_visible_APs,timestamp,x,y,z,floorID\n"
    b"-38.0,-100.0,-72.5,2,0.0,14.25,0.5,1.4,0\n"
    b"-100.0,-50.0,-100.0,1,3.95,14.5,0.75,1.4,0\n"
)

SCANS = (
    b"time_s,bssid,rssi_dbm,frequency_mhz,last_seen_s\n"
    b"0.5,aa:01,-48,2412,0.25\n"
    b"0.5,aa:02,-71.5,,\n"
    b"2.5,aa:01,-55,5180,2.25\n"
)
TUM = b"# t x y z qx qy qz qw\n0.0 0 0 0 0 0 0 1\n1.0 1.5 0 0 0 0 0.7071067811865476 0.7071067811865476\n"
REFERENCE = b"time_s,x_m,y_m\n0.0,1.0,2.0\n2.5,3.0,4.0\n"
INERTIAL = b"time_s,ax,ay,az,gx,gy,gz,qx,qy,qz,qw\n0.0,0,0,9.81,,,,0,0,0,1\n0.02,0,0.5,9.8,0.1,0.2,0.3,0,0,1,0\n"
BLE = b"time_s,identity,rssi_dbm\n0.75,be:ac,-80\n"
ABOUT = b'device = "robot"\nfloor = "3"\norigin_latitude_deg = 49.5\norigin_longitude_deg = 11.0\n'
OPEN_FOLDER = {
    "scans.csv": SCANS,
    "trajectory.tum": TUM,
    "reference.csv": REFERENCE,
    "inertial.csv": INERTIAL,
    "ble.csv": BLE,
    "walk.toml": ABOUT,
}
