"""Small logs written by hand, one per format."""

import csv
import io
import json
import zipfile
from typing import Any

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


def zipped(files: dict[str, bytes]) -> bytes:
    """A zip with these files; the same files give the same bytes."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return target.getvalue()


T_NS = 1_715_936_400_000_000_000
_ROOT_HALF = "0.7071067811865476"
SENSOR_LOGGER_FILES = {
    "Metadata.csv": (
        b"version,device name,recording epoch time,recording time,recording timezone,platform,appVersion,device id,"
        b"sensors,sampleRateMs,standardisation,platform version\n"
        b"3,Pixel 7,1715936400000,2024-05-17_09-00-00,Europe/Berlin,android,1.36,7c9,WiFi|Location,10|0,false,14\n"
    ),
    "Accelerometer.csv": (
        f"time,seconds_elapsed,z,y,x\n{T_NS},0.0,0.1,0.2,0.3\n{T_NS + 20_000_000},0.02,0.0,0.0,0.0\n"
    ).encode(),
    "Gravity.csv": (
        f"time,seconds_elapsed,z,y,x\n{T_NS},0.0,9.8,0.5,0.0\n{T_NS + 20_000_000},0.02,9.8,0.5,0.0\n"
    ).encode(),
    "TotalAcceleration.csv": (
        f"time,seconds_elapsed,z,y,x\n{T_NS},0.0,9.9,0.7,0.3\n{T_NS + 20_000_000},0.02,9.8,0.5,0.0\n"
        f"{T_NS + 9_000_000_000},9.0,9.8,0.5,0.0\n"
    ).encode(),
    "Gyroscope.csv": f"time,seconds_elapsed,z,y,x\n{T_NS},0.0,0.03,0.02,0.01\n".encode(),
    "Magnetometer.csv": f"time,seconds_elapsed,z,y,x\n{T_NS},0.0,-42.0,2.0,18.0\n".encode(),
    "Orientation.csv": (
        f"time,seconds_elapsed,qz,qy,qx,qw,roll,pitch,yaw\n{T_NS},0.0,{_ROOT_HALF},0.0,0.0,{_ROOT_HALF},0.0,0.0,-1.57\n"
    ).encode(),
    "Location.csv": (
        "time,seconds_elapsed,bearingAccuracy,speedAccuracy,verticalAccuracy,horizontalAccuracy,speed,bearing,altitude,"
        "longitude,latitude\n"
        f"{T_NS + 500_000_000},0.5,0,0,1.8,15.1,0,0,214.2,11.5,48.1\n"
        f"{T_NS + 1_500_000_000},1.5,0,0,1.8,9.06,0,0,214.2,11.5001,48.1\n"
        f"{T_NS + 2_500_000_000},2.5,0,0,1.8,-1,0,0,214.2,11.6,48.1\n"
    ).encode(),
    "WiFi.csv": (
        "time,seconds_elapsed,ssid,bssid,level,frequency,capabilities\n"
        f'{T_NS + 1_000_000_000},1.0,"Cafe, ""Rose""",20:23:00:00:00:0A,-60,2437,[WPA2-PSK-CCMP][ESS]\n'
        f"{T_NS + 1_000_300_000},1.0003,Guest,20:23:00:00:00:15,-63,5180,[ESS]\n"
        f"{T_NS + 1_000_300_000},1.0003,home_nomap,20:23:00:00:00:16,-50,5180,[ESS]\n"
        f"{T_NS + 1_000_300_000},1.0003,,20:23:00:00:00:17,-51,5180,[ESS]\n"
        f"{T_NS + 5_000_000_000},5.0,Guest,20:23:00:00:00:15,-61,5180,[ESS]\n"
    ).encode(),
    "Bluetooth.csv": (
        "time,seconds_elapsed,id,rssi,txPowerLevel,manufacturerData\n"
        f"{T_NS + 2_000_000_000},2.0,DB:08:D3:33:38:EF,-79,,99040512\n"
        f"{T_NS + 2_100_000_000},2.1,DB:08:D3:33:38:EF,,,99040512\n"
    ).encode(),
    "Annotation.csv": f"time,seconds_elapsed,text,millisecond_press_duration\n{T_NS},0.0,start,80\n".encode(),
}
SENSOR_LOGGER = zipped(SENSOR_LOGGER_FILES)


def sensor_logger_records() -> list[dict[str, str]]:
    """The same recording as the app's JSON export has it, sensor by sensor."""
    records = []
    for name, content in SENSOR_LOGGER_FILES.items():
        rows = csv.DictReader(io.StringIO(content.decode()))
        records += [{"sensor": name.removesuffix(".csv"), **row} for row in rows]
    return records


SENSOR_LOGGER_JSON = json.dumps(sensor_logger_records(), indent=1).encode()


def sensor_logger_messages() -> list[dict[str, Any]]:
    """The same as the app pushes it, three readings a message, the last message first; it pushes no metadata."""
    readings = []
    for record in sensor_logger_records():
        values: dict[str, Any] = {key: value for key, value in record.items() if key not in ("sensor", "time")}
        if record["sensor"] not in ("Metadata", "Annotation"):
            readings.append({"name": record["sensor"].lower(), "time": int(record["time"]), "values": values})
    starts = range(0, len(readings), 3)
    head = {"sessionId": "s1", "deviceId": "d1"}
    messages = [{"messageId": k, **head, "payload": readings[at : at + 3]} for k, at in enumerate(starts)]
    return messages[::-1]


SENSOR_LOGGER_PUSH = "\n".join(map(json.dumps, sensor_logger_messages())).encode()

POSES = (
    b"timestamp,tx,ty,tz,qx,qy,qz,qw\n"
    b"1000.0,0.0,1.4,0.0,0,0,0,1\n"
    b"1000.5,0.0,1.4,-0.6,0,0,0,1\n"
    b"1001.0,0.5,1.41,-0.6,0,-0.7071067811865476,0,0.7071067811865476\n"
)
ARCORE_POSES = (
    b"# Created at Mon Sep 09 23:13:04 PDT 2019 in Burnaby Canada \n"
    b"1000000000000 0.000000 0.000000 0.000000 1.000000 0.000000 1.400000 0.000000 \n"
    b"1000500000000 0.000000 0.000000 0.000000 1.000000 0.000000 1.400000 -0.600000 \n"
    b"1001000000000 0.000000 -0.707107 0.000000 0.707107 0.500000 1.410000 -0.600000 \n"
)
ARKIT_POSES = (
    b"# Created at 2019-06-10\n"
    b"1000.0 1 0 0 0.0 0 1 0 1.4 0 0 1 0.0\n"
    b"1000.5 1 0 0 0.0 0 1 0 1.4 0 0 1 -0.6\n"
    b"1001.0 0 0 -1 0.5 0 1 0 1.41 1 0 0 -0.6\n"
)
AR_WIFI = (
    b"Timestamp_ms,SSID,BSSID,Frequency,RSSI\n"
    b'1000200,"Guest",20:23:00:00:00:0A,2437,-60\n'
    b"1000200,Guest,20-23-00-00-00-15,,-63\n"
    b"1000900,Guest,20:23:00:00:00:0a,2437,-61\n"
)

TERMUX_SCAN = """[
  {
    "bssid": "20:23:00:00:00:0A",
    "frequency_mhz": 2437,
    "rssi": -60,
    "ssid": "Guest",
    "timestamp": 5000000,
    "channel_bandwidth_mhz": "20",
    "capabilities": "[WPA2-PSK-CCMP][ESS]"
  },
  {
    "bssid": "20:23:00:00:00:15",
    "frequency_mhz": 5180,
    "rssi": -63,
    "ssid": "Guest",
    "timestamp": 2000000,
    "channel_bandwidth_mhz": "80",
    "center_frequency_mhz": 5210
  }
]
"""
TERMUX = (TERMUX_SCAN + TERMUX_SCAN.replace("5000000", "9000000").replace("-60", "-62")).encode()

IW = (
    b"1715936400.25\n"
    b"BSS 20:23:00:00:00:0a(on wlan0) -- associated\n"
    b"\tlast seen: 2804.000s [boottime]\n"
    b"\tTSF: 119952901774 usec (1d, 09:19:12)\n"
    b"\tfreq: 2437.0\n"
    b"\tbeacon interval: 100 TUs\n"
    b"\tcapability: ESS Privacy ShortSlotTime (0x0411)\n"
    b"\tsignal: -52.00 dBm\n"
    b"\tlast seen: 52 ms ago\n"
    b"\tInformation elements from Probe Response frame:\n"
    b"\tSSID: Guest\n"
    b"\tSupported rates: 1.0* 2.0* 5.5* 11.0* \n"
    b"BSS 20:23:00:00:00:15(on wlan0)\n"
    b"\tlast seen: 2801.500s [boottime]\n"
    b"\tfreq: 5180\n"
    b"\tsignal: -71.00 dBm\n"
    b"\tlast seen: 2552 ms ago\n"
    b"\tSSID: caf\\xc3\\xa9\n"
    b"BSS 20:23:00:00:00:17(on wlan0)\n"
    b"\tfreq: 5180\n"
    b"\tsignal: -77.00 dBm\n"
    b"\tlast seen: 10 ms ago\n"
    b"\tSSID: \\x00\\x00\\x00\n"
    b"1715936404.5\n"
    b"BSS 20:23:00:00:00:0a(on wlan0)\n"
    b"\tfreq: 2437\n"
    b"\tsignal: -55.00 dBm\n"
    b"\tlast seen: 100 ms ago\n"
    b"\tSSID: Guest\n"
)

WIGLE = (
    b'WigleWifi-1.6,appRelease=2.78,model=Pixel 7,release=14,device=panther,display=x,board=gs,"brand=Google, LLC",'
    b"star=Sol,body=3,subBody=0\n"
    b"MAC,SSID,AuthMode,FirstSeen,Channel,Frequency,RSSI,CurrentLatitude,CurrentLongitude,AltitudeMeters,"
    b"AccuracyMeters,RCOIs,MfgrId,Type\n"
    b'20:23:00:00:00:0A,"Cafe, ""Rose""",[WPA2],2024-05-17 09:00:00,6,2437,-60,48.1,11.5,500,4.53,,,WIFI\n'
    b"20:23:00:00:00:15,Guest,[ESS],2024-05-17 09:00:00,36,5180,-63,48.1,11.5,500,4.53,,,WIFI\n"
    b"db:08:d3:33:38:ef,,Misc,2024-05-17 09:00:02,0,,-79,48.1,11.50005,500,4.53,,76,BLE\n"
    b"310260_1_2,T,LTE,2024-05-17 09:00:02,0,,-110,48.1,11.50005,500,4.53,,,LTE\n"
    b"20:23:00:00:00:0A,Cafe,[WPA2],2024-05-17 09:00:04,6,2437,-61,48.1,11.5001,500,4.53,,,WIFI\n"
    b"20:23:00:00:00:15,Guest,[ESS],2024-05-17 09:00:08,36,5180,-64,0.0,0.0,0,0,,,WIFI\n"
    b"20:23:00:00:00:99,my_optout_net,[ESS],2024-05-17 09:00:08,36,5180,-64,48.1,11.5001,500,4.53,,,WIFI\n"
)
