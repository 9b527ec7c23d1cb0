! SPDX-License-Identifier: MIT
!> Systems of units, and quantities in them as they are shown.
!>
!> The program computes in the numbers that it is given. A system says what they are:
!>
!>     SI     m, kg, s, N, Pa
!>     kN     m, t, s, kN, kPa
!>     mm     mm, t, s, N, MPa
!>     none   any consistent units, which have no names: [length], [force] ...
!>
!> Dimensions are written as the table of options has them: 'stress/length'. Models are plane: a mass per area is that
!> of a unit of thickness, and is shown as a density; so is a weight per area.
!> Forces are shown for a metre of thickness.
module rockdda_model_units
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   implicit none
   private
   public :: unit_system_type, unit_system, unit_system_names, most_units

   character(len=*), parameter :: unit_system_names(4) = [character(len=4) :: 'SI', 'kN', 'mm', 'none']
   !> Length of the longest name of a unit.
   integer, parameter :: most_units = 24

   !> The characters of superscripts and of degrees, UTF-8.
   character(len=*), parameter :: squared = char(194)//char(178), cubed = char(194)//char(179), degree = &
                                  char(194)//char(176)

   type :: unit_system_type
      character(len=4) :: name = 'none'
      !> of the units of length, mass and time [m, kg, s]
      real(wp) :: length = 1, mass = 1, time = 1
      character(len=2) :: length_name = '', mass_name = ''
      character(len=3) :: force_name = '', stress_name = ''
   contains
      procedure :: is_known
      procedure :: in_si
      procedure :: unit_of
      procedure :: shown
      procedure :: description
   end type unit_system_type

   !> Multiples that are shown, of the unit of SI, from large to small; values below `least` are shown in the next one.
   type :: multiple_type
      character(len=14) :: dimension = '', name = ''
      real(wp) :: size = 1, least = 0
   end type multiple_type

   type(multiple_type), parameter :: multiples(*) = [ &
      multiple_type('length', 'm', 1.0_wp, 0.1_wp), &
      multiple_type('length', 'mm', 1.0e-3_wp, 0.0_wp), &
      multiple_type('length^2', 'm'//squared, 1.0_wp, 1.0e-2_wp), &
      multiple_type('length^2', 'mm'//squared, 1.0e-6_wp, 0.0_wp), &
      multiple_type('time', 's', 1.0_wp, 0.0_wp), &
      multiple_type('1/time', '1/s', 1.0_wp, 0.0_wp), &
      multiple_type('mass/length^2', 'kg/m'//cubed, 1.0_wp, 0.0_wp), &
      multiple_type('force/length^2', 'kN/m'//cubed, 1.0e3_wp, 0.0_wp), &
      multiple_type('stress', 'MPa', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('stress', 'kPa', 1.0e3_wp, 0.0_wp), &
      multiple_type('stress/length', 'MPa/m', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('stress/length', 'kPa/m', 1.0e3_wp, 0.0_wp), &
      multiple_type('force', 'MN', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('force', 'kN', 1.0e3_wp, 0.0_wp), &
      multiple_type('force/length', 'MN/m', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('force/length', 'kN/m', 1.0e3_wp, 0.0_wp), &
      multiple_type('thrust', 'MN/m', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('thrust', 'kN/m', 1.0e3_wp, 0.0_wp), &
      multiple_type('moment', 'MNm/m', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('moment', 'kNm/m', 1.0e3_wp, 0.0_wp), &
      multiple_type('energy', 'MJ', 1.0e6_wp, 1.0e6_wp), &
      multiple_type('energy', 'kJ', 1.0e3_wp, 1.0_wp), &
      multiple_type('energy', 'J', 1.0_wp, 0.0_wp), &
      multiple_type('length/time', 'm/s', 1.0_wp, 0.1_wp), &
      multiple_type('length/time', 'mm/s', 1.0e-3_wp, 0.0_wp), &
      multiple_type('length/time^2', 'm/s'//squared, 1.0_wp, 0.0_wp)]

contains

   !> The system of a name; an unknown name, and an empty one, are 'none'.
   pure function unit_system(name) result(system)
      character(len=*), intent(in) :: name
      type(unit_system_type) :: system
      select case (name)
      case ('SI', 'si')
         system = unit_system_type('SI', 1.0_wp, 1.0_wp, 1.0_wp, 'm', 'kg', 'N', 'Pa')
      case ('kN', 'kn')
         system = unit_system_type('kN', 1.0_wp, 1.0e3_wp, 1.0_wp, 'm', 't', 'kN', 'kPa')
      case ('mm')
         system = unit_system_type('mm', 1.0e-3_wp, 1.0e3_wp, 1.0_wp, 'mm', 't', 'N', 'MPa')
      end select
   end function unit_system

   !> Are the units known?
   pure logical function is_known(self)
      class(unit_system_type), intent(in) :: self
      is_known = self%name /= 'none'
   end function is_known

   !> Powers of length, mass and time of a dimension; 0 of a pure number.
   pure function powers(dimension)
      character(len=*), intent(in) :: dimension
      integer :: powers(3)
      select case (dimension)
      case ('length'); powers = [1, 0, 0]
      case ('length^2'); powers = [2, 0, 0]
      case ('time'); powers = [0, 0, 1]
      case ('1/time'); powers = [0, 0, -1]
      case ('mass/length^2'); powers = [-3, 1, 0]
      case ('force/length^2', 'stress/length'); powers = [-2, 1, -2]
      case ('stress'); powers = [-1, 1, -2]
      case ('force', 'thrust'); powers = [0, 1, -2]   ! per metre of thickness, as the next three
      case ('force/length'); powers = [-1, 1, -2]
      case ('energy', 'moment'); powers = [1, 1, -2]   ! a moment on a section, per metre
      case ('length/time'); powers = [1, 0, -1]
      case ('length/time^2'); powers = [1, 0, -2]
      case default; powers = 0
      end select
   end function powers

   !> A value in the unit of SI.
   pure real(wp) function in_si(self, value, dimension)
      class(unit_system_type), intent(in) :: self
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: dimension
      integer :: p(3)
      p = powers(dimension)
      in_si = value*self%length**p(1)*self%mass**p(2)*self%time**p(3)
   end function in_si

   !> The unit of the numbers themselves: 'kN/m^2'. The dimension where the units are not known; '1' of a pure number.
   pure function unit_of(self, dimension) result(unit)
      class(unit_system_type), intent(in) :: self
      character(len=*), intent(in) :: dimension
      character(len=:), allocatable :: unit
      unit = trim(dimension)
      if (len(unit) == 0) unit = '1'
      if (.not. self%is_known()) return
      select case (dimension)
      case ('length'); unit = trim(self%length_name)
      case ('length^2'); unit = trim(self%length_name)//'^2'
      case ('time'); unit = 's'
      case ('1/time'); unit = '1/s'
      case ('mass/length^2'); unit = trim(self%mass_name)//'/'//trim(self%length_name)//'^3'
      case ('force/length^2'); unit = trim(self%force_name)//'/'//trim(self%length_name)//'^3'
      case ('stress/length'); unit = trim(self%stress_name)//'/'//trim(self%length_name)
      case ('stress'); unit = trim(self%stress_name)
      case ('force'); unit = trim(self%force_name)
      case ('force/length'); unit = trim(self%force_name)//'/'//trim(self%length_name)
      case ('energy')
         unit = trim(self%force_name)//' '//trim(self%length_name)
         if (self%name == 'SI') unit = 'J'
         if (self%name == 'kN') unit = 'kJ'
      case ('length/time'); unit = trim(self%length_name)//'/s'
      case ('length/time^2'); unit = trim(self%length_name)//'/s^2'
      end select
   end function unit_of

   !> A value as it is shown, in a multiple that suits: '5.3 mm', '20000 MPa', '26.5 kN/m3'. The number alone where the
   !> units are not known, and a pure one.
   pure function shown(self, value, dimension, digits) result(text)
      class(unit_system_type), intent(in) :: self
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: dimension
      integer, intent(in), optional :: digits        !! default 4
      character(len=:), allocatable :: text
      real(wp) :: si
      integer :: i, n
      n = 4
      if (present(digits)) n = digits
      text = to_string(value, n)
      if (.not. self%is_known()) return
      if (dimension == 'deg') text = text//degree
      si = self%in_si(value, dimension)
      do i = 1, size(multiples)
         if (multiples(i)%dimension /= dimension) cycle
         text = to_string(si/multiples(i)%size, n)//' '//trim(multiples(i)%name)
         if (abs(si) >= multiples(i)%least*(1 - 1.0e-12_wp)) return
      end do
   end function shown

   !> 'SI (m, kg, s, N, Pa)'
   pure function description(self) result(text)
      class(unit_system_type), intent(in) :: self
      character(len=:), allocatable :: text
      text = trim(self%name)
      if (self%is_known()) text = text//' ('//trim(self%length_name)//', '//trim(self%mass_name)//', s, '// &
                                  trim(self%force_name)//', '//trim(self%stress_name)//')'
   end function description

end module rockdda_model_units
